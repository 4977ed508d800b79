"""A clock that is off by so much that the targets were elsewhere meanwhile, or a file that states another rate.

What is linear in a delay explains no more than a part of its misses then. Every offset is tried instead: where one
alone brings a camera's tracks to the epipolar lines of all the others, its clock is what is wrong. Where none does, the
rates of common cameras are tried: a recording that states 25 pictures a second of 29.97 is stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.location.cameras.views import View
from vidtrack.location.clocks.hidden_losses import hidden_losses, losses_finding
from vidtrack.location.clocks.rough_clock import rough_offset
from vidtrack.timing.resample import interval


@dataclass(frozen=True)
class FarOff:
    """When a clock is what is wrong.

    longest_s  how far off it is sought, and share of the recording
    share      of it
    better     times nearer to the epipolar lines with the clock put right: a turned camera leaves most of its misses
    steps      sampling intervals, at least: smaller delays are found by the misses themselves
    rates      pictures a second that recorders have; those of 29.97 and others are within 0.1 % of one
    slowed     times by which slow motion is stretched, or time-lapse is shortened, besides
    begun_s    how far apart recordings of two rates may have begun
    """

    longest_s: float = 5.0
    share: float = 0.5
    better: float = 4.0
    steps: float = 3.0
    rates: tuple[int, ...] = (24, 25, 30, 50, 60)
    slowed: tuple[float, ...] = (4.0, 5.0, 8.0, 10.0)
    begun_s: float = 0.5


FAR_OFF = FarOff()


def clock_far_off(views: Sequence[View], times: Sequence[Array], sought: Sequence[bool]) -> Finding | None:
    """The camera whose clock alone explains why the lines of sight miss; None where none does.

    times   (T,) s of each camera's samples, corrected
    sought  whether a camera's clock was estimated: then it is not what is wrong
    """
    n = len(views)
    if n < 2 or any(t.size < 2 for t in times):
        return None
    step = max(interval(t) for t in times)
    reach = min(FAR_OFF.longest_s, FAR_OFF.share * min(float(np.ptp(t)) for t in times))
    if reach < FAR_OFF.steps * step:
        return None
    late, px = np.zeros((n, n)), np.zeros((n, n, 2))
    for i, j in combinations(range(n), 2):
        a, b = views[i], views[j]
        rough = rough_offset(a.camera, times[i], a.b, b.camera, times[j], b.b, reach)
        late[i, j] = np.nan if rough.twins else rough.offset_s
        late[j, i] = -late[i, j]
        px[i, j] = px[j, i] = rough.px, rough.px_without
    for k in reversed(range(n)):
        others = [i for i in range(n) if i != k]
        offset, near, before = float(np.median(late[others, k])), px[others, k, 0], px[others, k, 1]
        alike = np.abs(late[others, k] - offset) <= 1.5 * step
        if sought[k] or not alike.all() or not abs(offset) >= FAR_OFF.steps * step:
            continue
        if (FAR_OFF.better * near < before).all() and all(late[i, j] == 0 for i, j in combinations(others, 2)):
            return _finding(views[k].name, [views[i].name for i in others], offset, near.max(), before.max())
    stretched, lost = _other_rate(views, times, px[..., 0]), hidden_losses(views, times)
    if lost is not None and (stretched is None or lost.px < stretched[0]):
        return losses_finding(lost, views)
    return None if stretched is None else stretched[1]


def _other_rate(views: Sequence[View], times: Sequence[Array], near: Array) -> tuple[float, Finding] | None:
    """The camera whose pictures came at another rate than its file states, where that alone explains the misses; px.

    near  (n, n) px, how near the tracks of two cameras come by an offset alone
    A clock that was sought at a wrong rate says nothing: the recording is tried from the others' beginning, too.
    """
    n, best, found = len(views), np.inf, None
    ratios = {a / b for a in FAR_OFF.rates for b in FAR_OFF.rates if a != b}
    ratios |= {q for slow in FAR_OFF.slowed for q in (slow, 1 / slow)}
    for k, q in ((k, q) for k in reversed(range(n)) for q in sorted(ratios)):
        others = [i for i in range(n) if i != k]
        since, a = (times[k] - times[k][0]) * q, views[k]
        long = min(FAR_OFF.longest_s, FAR_OFF.share * min(np.ptp(own) for own in (since, *(times[i] for i in others))))
        begun = float(np.median([times[i][0] for i in others]))
        far = abs(begun - times[k][0]) > FAR_OFF.begun_s
        for start, reach in ((times[k][0], FAR_OFF.begun_s), *(((begun, float(long)),) if far else ())):
            own = (a.camera, start + since, a.b, reach)
            tried = [rough_offset(views[i].camera, times[i], views[i].b, *own) for i in others]
            px = np.array([one.px for one in tried])
            if (FAR_OFF.better * px < near[others, k]).all() and px.max() < best:
                best, found = float(px.max()), (k, q, float(near[others, k].max()))
    if found is None:
        return None
    k, q, before = found
    return best, _rate_finding([v.name for v in views], k, [1 / interval(t) for t in times], q, best, before)


def _rate_finding(
    names: Sequence[str], k: int, rates: Sequence[float], q: float, near_px: float, before_px: float
) -> Finding:
    other = next(i for i in range(len(names)) if i != k)
    either = f", or those of {names[other]} at {rates[other] * q:.4g} instead of {rates[other]:.4g}"
    text = (
        f"{names[k]}: its pictures seem to have come at {rates[k] / q:.4g} a second, where its file states "
        f"{rates[k]:.4g}{either if len(names) == 2 else ''}: with that tracks lie {near_px:.2g} px from the others' "
        f"epipolar lines, without it {before_px:.2g} px"
    )
    cure = f"Give cameras.<name>.rate of the recording that is stretched, such as cameras.{names[k]}.rate."
    return Finding("bad", "picture-rate-wrong", text, cure)


def _finding(name: str, others: Sequence[str], offset_s: float, near_px: float, before_px: float) -> Finding:
    text = (
        f"{name}: its clock is off against {' and '.join(others)} by about {abs(offset_s):.3g} s: with that its tracks "
        f"lie {near_px:.2g} px from the others' epipolar lines, without it {before_px:.2g} px"
    )
    cure = (
        f"Set cameras.{name}.clock: auto, or give its offset_s, about {offset_s:+.3g}. A recording that was trimmed "
        "keeps the time code of its old beginning."
    )
    return Finding("bad", "clock-far-off", text, cure)
