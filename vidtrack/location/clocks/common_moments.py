"""The moments at which two cameras or more of a run were recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.errors import VidtrackError
from vidtrack.location.cameras.views import View
from vidtrack.timing.resample import COINCIDE, common_times, interval

LARGEST_ZONE_H = 14.0
"""h between two clocks that are right in their zones."""
NON_DROP, NON_DROP_WITHIN = 1.001, 2e-4
"""Seconds of a clock for one of a label, whose 24, 30 or 60 pictures take 1.001 s; how nearly the interval is that."""


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
    """The whole or half hours that would bring one camera to the time of the first one; "" where none do.

    An hour of non-drop labels at 29.97 or the like takes 3603.6 s: cameras of one run are on one scale of seconds.
    """
    first, others = (views[0], times[0]), list(zip(views[1:], times[1:], strict=True))
    for view, t in others if first[1].size else []:
        if not t.size:
            continue
        hour_s = 3600.0 * max(_label_s(*first), _label_s(view, t))
        hours = round(2 * float(t[0] - first[1][0]) / hour_s) / 2
        begin, end = t[[0, -1]] - hour_s * hours
        if 0 < abs(hours) <= LARGEST_ZONE_H and begin <= first[1][-1] and first[1][0] <= end:
            later = "later" if hours > 0 else "earlier"
            return (
                f"{view.name} is {abs(hours):g} h {later} than {first[0].name}: a clock in another time zone, or "
                f"summer time in one alone. Set cameras.{view.name}.clock.offset_s: {round(-hour_s * hours, 3):g}."
            )
    return ""


def _label_s(view: View, t: Array) -> float:
    """Seconds that a second of a camera's labels takes: 1.001 where non-drop code counts 29.97 pictures as 30."""
    if t.size < 2 or any(";" in str(label) for label in view.timecode[:1]):
        return 1.0
    step = interval(t)
    return (
        NON_DROP if abs(step * round(1 / step) - NON_DROP) < NON_DROP_WITHIN and ":" in str(view.timecode[0]) else 1.0
    )


def recorded_twice(times: Sequence[Array]) -> tuple[Array, Ints]:
    """The common moments (M,) s at which two cameras or more were recording, and the camera (M,) that each is of."""
    at, whose = common_times(times)
    slack = COINCIDE * interval(at) if at.size > 1 else 0.0
    running = [(at >= t[0] - slack) & (at <= t[-1] + slack) for t in times if t.size]
    twice = np.sum(running, 0) >= 2
    return at[twice], whose[twice]
