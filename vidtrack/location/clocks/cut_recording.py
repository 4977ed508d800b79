"""A part of one camera's recording that was cut out, or that it did not take, while its time goes on without it.

Up to the cut its track is a target's; from there on it is no target's: the other cameras show the target where it
was before: the track would fit at other moments of theirs. How far off these are is what is missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import NONE
from vidtrack.findings import Finding
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.location.cameras.views import View, of_samples
from vidtrack.location.matching import Match
from vidtrack.timing.clock_text import readable
from vidtrack.timing.resample import interval


@dataclass(frozen=True)
class CutSettings:
    """When the end of a track is a target's at another time.

    share    of the run, how far off it is sought
    fewest   samples that must be compared, and share of the track's end
    least    sample intervals by which it is off, at least
    better   times farther from the other cameras' epipolar lines than at the other time
    """

    share: float = 0.6
    fewest: int = 15
    compared: float = 0.5
    least: float = 2.0
    better: float = 4.0


CUT = CutSettings()


class Cut(NamedTuple):
    """From when on a track shows its target `later` s after its own time; px rms from the lines so, and without."""

    since_s: float
    later: float
    px: float
    before_px: float


def cut_recordings(views: Sequence[View], match: Match, times: Sequence[Array], tolerance_px: float) -> list[Finding]:
    """What to say of cameras whose tracks are a target's only up to a moment; times (T,) s of each one's samples."""
    whose = [of_samples(v.piece, trajectory) for v, trajectory in zip(views, match.trajectory, strict=True)]
    findings = []
    for i, view in enumerate(views):
        found = [
            cut
            for row, since, k in _ends(whose[i], np.isfinite(view.b[..., 0]))
            if (cut := _cut(views, times, i, view.b[row], since, _tracks(whose, i, k)))
            and cut.px < tolerance_px < cut.before_px
        ]
        if found:
            findings.append(_finding(view.name, min(found, key=lambda cut: cut.px), len(views)))
    return findings


def _ends(whose: Ints, measured: Bools) -> Iterator[tuple[int, int, int]]:
    """Tracks that are no target's after some moment: row, the first sample after it, the target before it."""
    for row in range(len(whose)):
        shared = np.flatnonzero(measured[row] & (whose[row] != NONE))
        since = int(shared[-1]) + 1 if shared.size else 0
        if since and measured[row, since:].sum() >= CUT.fewest:
            yield row, since, int(whose[row, since - 1])


def _tracks(whose: Sequence[Ints], i: int, k: int) -> dict[int, int]:
    """The track of each other camera that shows target k for the longest: all of it, for its end may be alone too."""
    counts = {j: (target == k).sum(1) for j, target in enumerate(whose) if j != i}
    return {j: int(n.argmax()) for j, n in counts.items() if n.any()}


def _cut(
    views: Sequence[View], times: Sequence[Array], i: int, b: Array, since: int, tracks: dict[int, int]
) -> Cut | None:
    """How much later than its own time the end of a track b (T, 2) is its target's, by the others' tracks."""
    step, own = interval(times[i]), np.flatnonzero(np.isfinite(b[:, 0]))
    own = own[own >= since]
    n = int(CUT.share * len(b))
    offsets = np.arange(-n, n + 1)
    rms = np.full(offsets.size, np.inf)
    for k, offset in enumerate(offsets):
        when = times[i][own] + offset * step
        each = [
            epipolar_distance(views[j].camera, views[i].camera, _at(times[j], views[j].b[row], when), b[own])
            for j, row in tracks.items()
        ]
        far = np.concatenate(each) if each else np.empty(0)
        far = far[np.isfinite(far)]
        if far.size >= max(CUT.fewest, CUT.compared * own.size):
            rms[k] = np.sqrt((far**2).mean())
    best, before = int(rms.argmin()), float(rms[n])
    if not np.isfinite(before) or abs(offsets[best]) < CUT.least or before < CUT.better * rms[best]:
        return None
    return Cut(float(times[i][since]), float(offsets[best] * step), float(rms[best]), before)


def _at(t: Array, b: Array, when: Array) -> Array:
    """A track b (T, 2) at other moments (m,), between samples that were measured: (m, 2), NaN elsewhere."""
    inside = (when >= t[0]) & (when <= t[-1])
    values = np.stack([np.interp(when, t, b[:, axis]) for axis in (0, 1)], -1)  # NaN where a sample beside it is
    return np.where(inside[:, None], values, np.nan)


def _finding(name: str, cut: Cut, n: int) -> Finding:
    when, size = readable(cut.since_s), f"{abs(cut.later):.3g} s"
    how = (
        f"ahead of the others', as if {size} were cut out there"
        if cut.later > 0
        else (f"behind the others', as if {size} came twice there, or were cut out of those")
    )
    text = (
        f"{name}: from {when} on its recording is {size} {how}: so its track lies {cut.px:.2g} px from their epipolar "
        f"lines, as its time has it {cut.before_px:.2g} px; it has no part in the positions there"
    )
    cure = (
        f"Take the recording as {name} wrote it, whole, with its time code or time stamps; or let the run end there "
        "(runs.<run>.detect.end)."
    )
    return Finding("doubtful" if n > 2 else "bad", "recording-cut", text, cure)
