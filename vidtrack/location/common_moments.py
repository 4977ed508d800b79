"""The moments at which two cameras or more of a run were recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.errors import VidtrackError
from vidtrack.location.views import View
from vidtrack.timing.resample import COINCIDE, common_times, interval


def check_overlap(views: Sequence[View], times: Sequence[Array], where: str) -> None:
    """Raises VidtrackError where no two cameras (corrected times (T,) s each) were recording at one moment."""
    spans = [(t[0], t[-1]) for t in times if t.size]
    if any(a[0] <= b[1] and b[0] <= a[1] for i, a in enumerate(spans) for b in spans[i + 1 :]):
        return
    when = ", ".join(
        f"{v.name} {t[0]:.3f} to {t[-1]:.3f} s" if t.size else f"{v.name} nothing"
        for v, t in zip(views, times, strict=True)
    )
    raise VidtrackError(
        f"{where}: no two cameras saw a target at one moment ({when}). "
        "Check the time codes, or give cameras.<name>.clock.offset_s."
    )


def recorded_twice(times: Sequence[Array]) -> tuple[Array, Ints]:
    """The common moments (M,) s at which two cameras or more were recording, and the camera (M,) that each is of."""
    at, whose = common_times(times)
    slack = COINCIDE * interval(at) if at.size > 1 else 0.0
    running = [(at >= t[0] - slack) & (at <= t[-1] + slack) for t in times if t.size]
    twice = np.sum(running, 0) >= 2
    return at[twice], whose[twice]
