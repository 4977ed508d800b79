"""Cameras whose tracks are those of located targets, but at another time.

Where two cameras or more agree upon a target, a third whose clock is wrong shows the same path sooner or later: no
other camera then shows "the same target". The path shows how much. A clock that is off by an hour leaves no moment in
common.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.association.associate import NONE
from vidtrack.findings import Finding
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import Located
from vidtrack.location.cameras.views import Seen, View, of_samples
from vidtrack.location.matching import Match
from vidtrack.timing.resample import interval


@dataclass(frozen=True)
class LateSettings:
    """When a track is a target's at another time.

    longest_s  how far off a clock is sought
    parts      of a sample interval, the steps in which it is
    fewest     samples that must be compared, and share of the track's
    share      of them
    better     times farther from the target's place than with the clock put right
    """

    longest_s: float = 2.0
    parts: int = 4
    fewest: int = 20
    share: float = 0.5
    better: float = 3.0


LATE = LateSettings()


class Late(NamedTuple):
    """A camera and the target whose path its track is; what must be added to the camera's time, s; px rms with it and
    without (inf where too few samples can be compared)."""

    camera: int
    label: str
    offset_s: float
    px: float
    before_px: float


def late_cameras(
    views: Sequence[View], seen: Sequence[Seen], match: Match, located: Located, at: Array, tolerance_px: float
) -> list[Finding]:
    """What to say of cameras with tracks that no other camera shares, though at another time they would."""
    best: dict[int, Late] = {}
    for i, (view, own, trajectory) in enumerate(zip(views, seen, match.trajectory, strict=True)):
        whose = of_samples(view.piece, trajectory)
        for row in np.flatnonzero((whose == NONE).all(1) & np.isfinite(own.b[..., 0]).any(1)):
            for k, label in enumerate(match.labels):
                found = _late(own.b[row], project(view.camera, located.point[k]), at)
                if found and found[1] < tolerance_px and (i not in best or found[1] < best[i].px):
                    best[i] = Late(i, label, *found)
    return [_finding(late, views) for late in best.values()]


def cameras_apart(views: Sequence[View], times: Sequence[Array]) -> list[Finding]:
    """What to say of cameras that recorded at no moment at which another one did; times (T,), s, of each."""
    spans = {view.name: (float(t[0]), float(t[-1])) for view, t in zip(views, times, strict=True) if t.size}
    out = []
    for name, (first, last) in spans.items():
        others = {other: span for other, span in spans.items() if other != name}
        if not others or any(a <= last and first <= b for a, b in others.values()):
            continue
        begin, end = min(a for a, _ in others.values()), max(b for _, b in others.values())
        text = (
            f"{name}: it recorded from {first:.3f} to {last:.3f} s, when no other camera did ({begin:.3f} to {end:.3f} "
            "s): its clock is off, or this is another recording; it has no part in the positions"
        )
        out.append(
            Finding("doubtful", "camera-apart", text, f"Check its time code, or set cameras.{name}.clock: auto.")
        )
    return out


def _late(b: Array, path: Array, at: Array) -> tuple[float, float, float] | None:
    """Offset, s, with which px (M, 2) seen at `at` are on a path (M, 2); px rms with it and without."""
    known, there = np.isfinite(b).all(-1), np.isfinite(path).all(-1)
    if at.size < 2 or known.sum() < LATE.fewest or there.sum() < LATE.fewest:
        return None
    step = interval(at) / LATE.parts
    n = int(min(LATE.longest_s, (at[-1] - at[0]) / 2) / step)
    offsets = np.arange(-n, n + 1) * step
    least = max(LATE.fewest, LATE.share * known.sum())
    first, last = at[there][[0, -1]]
    rms = np.full(offsets.size, np.inf)
    for j, offset in enumerate(offsets):
        when = at[known] + offset
        inside = (when >= first) & (when <= last)
        if inside.sum() < least:
            continue
        moved = np.stack([np.interp(when[inside], at[there], path[there, axis]) for axis in (0, 1)], -1)
        rms[j] = np.sqrt(((b[known][inside] - moved) ** 2).sum(-1).mean())
    best = int(rms.argmin())
    if not np.isfinite(rms[best]) or best == n or rms[n] < LATE.better * rms[best]:
        return None
    return float(offsets[best]), float(rms[best]), float(rms[n])


def _finding(late: Late, views: Sequence[View]) -> Finding:
    name = views[late.camera].name
    later = "later" if late.offset_s < 0 else "sooner"
    before = f", {late.before_px:.3g} px by its own time" if np.isfinite(late.before_px) else ""
    text = (
        f"{name}: its clock differs from the others': it shows the path of {late.label} {abs(late.offset_s):.3g} s "
        f"{later} ({late.px:.2g} px rms from it then{before}), and has no part in its positions"
    )
    cure = f"Set cameras.{name}.clock: auto, or give its offset_s, about {late.offset_s:+.3g}."
    return Finding("doubtful", "clock-differs", text, cure)
