"""The moments at which two cameras or more of a run were recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.errors import VidtrackError
from vidtrack.location.views import View
from vidtrack.timing.resample import COINCIDE, common_times, interval

HALF_AN_HOUR, LARGEST_ZONE_H = 1800.0, 14.0
"""s; h between two clocks that are right in their zones."""


def check_overlap(views: Sequence[View], times: Sequence[Array], where: str) -> None:
    """Raises VidtrackError where no two cameras (corrected times (T,) s each) were recording at one moment."""
    spans = [(t[0], t[-1]) for t in times if t.size]
    if any(a[0] <= b[1] and b[0] <= a[1] for i, a in enumerate(spans) for b in spans[i + 1 :]):
        return
    when = ", ".join(
        f"{v.name} {t[0]:.3f} to {t[-1]:.3f} s" if t.size else f"{v.name} nothing"
        for v, t in zip(views, times, strict=True)
    )
    cause = _hours_apart(views, times) or (
        "Give cameras.<name>.clock.offset_s where a clock is off; a recording of another run may lie here."
    )
    raise VidtrackError(f"{where}: no two cameras saw a target at one moment ({when}). {_bare(views) or cause}")


def _bare(views: Sequence[View]) -> str:
    """What to do where some cameras have a time code and others have none; "" elsewhere."""
    without = [v.name for v in views if v.t.size and not (v.timecode != "").any()]
    if not without or len(without) == len(views):
        return ""
    return (
        f"{without[0]} has no time code and counts from its first picture, the others have one. Where its motion does "
        f"not show by how much it differs, give cameras.{without[0]}.clock.offset_s."
    )


def _hours_apart(views: Sequence[View], times: Sequence[Array]) -> str:
    """The whole or half hours that would bring one camera to the time of the first one; "" where none do."""
    first, others = (views[0], times[0]), list(zip(views[1:], times[1:], strict=True))
    for view, t in others if first[1].size else []:
        if not t.size:
            continue
        hours = round(float(t[0] - first[1][0]) / HALF_AN_HOUR) / 2
        begin, end = t[[0, -1]] - 3600 * hours
        if 0 < abs(hours) <= LARGEST_ZONE_H and begin <= first[1][-1] and first[1][0] <= end:
            later = "later" if hours > 0 else "earlier"
            return (
                f"{view.name} is {abs(hours):g} h {later} than {first[0].name}: a clock in another time zone, or "
                f"summer time in one alone. Set cameras.{view.name}.clock.offset_s: {-3600 * hours:g}."
            )
    return ""


def recorded_twice(times: Sequence[Array]) -> tuple[Array, Ints]:
    """The common moments (M,) s at which two cameras or more were recording, and the camera (M,) that each is of."""
    at, whose = common_times(times)
    slack = COINCIDE * interval(at) if at.size > 1 else 0.0
    running = [(at >= t[0] - slack) & (at <= t[-1] + slack) for t in times if t.size]
    twice = np.sum(running, 0) >= 2
    return at[twice], whose[twice]
