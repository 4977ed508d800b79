"""Tracks cut into tracklets: stretches in which it is certain that one and the same thing was followed.

Certainty ends where a track was not measured for a while, where it met another one, and where from one sample to the
next the position or the looks change as those of a single thing do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.window import WINDOW
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.state import CONTRAST, EDGE, MERGED, PIXELS, POSITION, RECOVERED, Rows, X


@dataclass(frozen=True)
class Certainty:
    """Where the certainty that one thing was followed ends.

    gap        samples that may be missing in a row without doubt, where nothing else is near
    jump_px    change of velocity, px a sample, at least, that counts as a jump; and jump_sizes: of its diameter
    looks      |log| of the ratio of pixel counts, or of contrasts, of two samples in a row
    shortest   samples measured, below which a track that is none of the targets' is taken for noise
    met_sizes  of the sum of their radii: how near to each other two tracklets end that have met
    met_within samples between the ends of tracklets that have met
    twice_px   between a target and another track, below which they follow one thing
    """

    gap: int = 2
    jump_px: float = 8.0
    jump_sizes: float = 1.5
    looks: float = 0.45
    shortest: int = 3
    met_sizes: float = 2.5
    met_within: int = 3
    twice_px: float = 2.0


CERTAINTY = Certainty()

_WHY = np.array(["", "looks", "jump", "lost", "meeting", "found"], object)


class CutTracks(NamedTuple):
    """N measured samples of tracklets, by tracklet and then by time; what is (m,) holds one value a tracklet.

    tracklet, sample  (N,) numbers from 0
    values            (CONTRAST + 1, N), rows X to CONTRAST of what was measured; flag (N,) bits of FLAGS
    target            (m,) number of the target that the tracker took it for, -1: none
    began, ended      (m,) why, in words
    met               (m,) numbers of the tracklets that took part in the meeting that ended it, in words
    """

    tracklet: Ints
    sample: Ints
    values: Array
    flag: NDArray[np.int64]
    target: Ints
    began: NDArray[np.object_]
    ended: NDArray[np.object_]
    met: NDArray[np.object_]


def cut_tracks(rows: Rows, others: Others) -> CutTracks:
    """Tracklets of n targets and of all else that was followed."""
    samples, n = rows.flag.shape
    others = _by_track(_besides(rows, others))
    track = np.concatenate([np.repeat(np.arange(n), samples), others.track])
    sample = np.concatenate([np.tile(np.arange(samples), n), others.sample])
    flag = np.concatenate([rows.flag.T.ravel(), others.flag])
    seen = np.flatnonzero(np.isfinite(np.concatenate([rows.values[X].T.ravel(), others.values[X]])))
    values = np.empty((CONTRAST + 1, seen.size))
    for row, own, other in zip(values, rows.values, others.values, strict=False):  # one at a time: there may be many
        row[:] = np.concatenate([own.T.ravel(), other])[seen]
    if not seen.size:
        none = np.zeros(0, object)
        return CutTracks(seen, seen, values, flag[seen], seen, none, none, none)
    hidden = [np.concatenate([[0], np.cumsum(flag & bit > 0)]) for bit in (MERGED, EDGE)]
    why = _reasons(track[seen], sample[seen], values, flag[seen], [many[seen] for many in hidden])
    starts = np.flatnonzero(why)
    ends = np.append(starts[1:], seen.size)
    numbers = np.repeat(np.arange(starts.size), ends - starts)
    began = _WHY[why[starts]]
    ended = _ended(seen, starts, ends, track, sample, flag, began, samples)
    began[(began == "found") & (sample[seen[starts]] == 0)] = "first"
    own = track[seen[starts]]
    target = np.where(own < n, own, -1)
    size = np.sqrt(values[PIXELS] / np.pi)
    met = _met(values[POSITION, ends - 1].T, size[ends - 1], sample[seen[ends - 1]], ended == "meeting")
    return CutTracks(numbers, sample[seen], values, flag[seen], target, began, ended, met)


def _besides(rows: Rows, others: Others) -> Others:
    """The others without what the targets' own rows show, and without tracks of a few samples."""
    if not others.track.size:
        return others
    where = rows.values[POSITION, others.sample]  # (2, N, n)
    near = np.hypot(*(where - others.values[POSITION, :, None])) < CERTAINTY.twice_px
    values = np.where(near.any(axis=1), np.nan, others.values)
    tracks, own = np.unique(others.track, return_inverse=True)
    count = np.bincount(own, weights=np.isfinite(values[X]), minlength=tracks.size)
    keep = (count >= CERTAINTY.shortest)[own]
    return Others(others.track[keep], others.sample[keep], values[:, keep], others.flag[keep])


def _by_track(others: Others) -> Others:
    """The samples in order of their tracks, which have higher numbers than the targets, and of time."""
    order = np.lexsort((others.sample, others.track))
    return Others(others.track[order], others.sample[order], others.values[:, order], others.flag[order])


def _reasons(track: Ints, sample: Ints, values: Array, flag: NDArray[np.int64], hidden: list[Ints]) -> NDArray[np.int8]:
    """Why a tracklet begins with each of the measured rows (N,), as a place in _WHY: 0 where it goes on."""
    why = np.zeros(track.size, np.int8)
    new = np.diff(track, prepend=-1) != 0
    gap = np.diff(sample, prepend=0)
    merged, _ = (np.diff(many, prepend=0) > 0 for many in hidden)
    again = (gap > CERTAINTY.gap + 1) | ((gap > 1) & (flag & RECOVERED > 0))
    jump, looks = _jumps(track, sample, values), _changes(values)
    for code, mask in enumerate((looks, jump, again, merged & (gap > 1), new), start=1):  # the last that holds
        why[mask] = code
    return why


def _jumps(track: Ints, sample: Ints, values: Array) -> Bools:
    """Rows (N,) that are not where the two before them in the track, without a gap, lead to, nor on the way to where
    the next ones go: a change of course that stays is one jump, and a course that bends none.

    A row that bends before a jump is of neither side for certain where another track jumps too, no farther away than
    the jump is: of two that bounce at once, each may be where the other was expected.
    """
    at = values[POSITION]
    bend = np.zeros(track.size)
    if track.size > 2:
        even = (track[2:] == track[:-2]) & (sample[2:] - sample[:-2] == 2)
        bend[2:] = np.where(even, np.hypot(*(at[:, 2:] - 2 * at[:, 1:-1] + at[:, :-2])), 0.0)
    size = 2 * np.sqrt(values[PIXELS] / np.pi)
    jump: Bools = bend > np.maximum(CERTAINTY.jump_px, CERTAINTY.jump_sizes * size)
    jump[1:] &= ~jump[:-1]  # the sample after a jump bends back
    before = np.flatnonzero(jump[1:] & (bend[:-1] > CERTAINTY.jump_px))  # 0 unless it is of the same track
    others = np.flatnonzero(jump)
    for i in before.tolist():
        near = (track[others] != track[i]) & (np.abs(sample[others] - sample[i]) <= 1)
        jump[i] = bool((near & (np.hypot(*(at[:, others] - at[:, i : i + 1])) < bend[i + 1])).any())
    return jump


def _changes(values: Array) -> Bools:
    """Rows (N,) whose pixel count or contrast is not that of the row before."""
    limit = CERTAINTY.looks + WINDOW.grain / np.minimum(values[PIXELS], np.roll(values[PIXELS], 1))
    changed = np.zeros(limit.size, bool)
    for row in values[PIXELS], values[CONTRAST]:  # one at a time: there may be many
        with np.errstate(divide="ignore", invalid="ignore"):
            changed |= np.abs(np.diff(np.log(row), prepend=np.nan)) > limit
    return changed


def _ended(
    seen: Ints,
    starts: Ints,
    ends: Ints,
    track: Ints,
    sample: Ints,
    flag: NDArray[np.int64],
    began: NDArray[np.object_],
    samples: int,
) -> NDArray[np.object_]:
    """Why each tracklet ends: as the next one of its track began, or by the flags of the row after its last."""
    last = seen[ends - 1]
    after = np.minimum(last + 1, track.size - 1)
    followed = (track[after] == track[last]) & (after > last)
    bits = np.where(followed, flag[after], 0)
    ended = np.full(starts.size, "lost", object)
    ended[bits & EDGE > 0] = "edge"
    ended[bits & MERGED > 0] = "meeting"
    following = np.append(began[1:], "")
    for word in ("jump", "looks", "meeting"):
        ended[following == word] = word
    ended[sample[last] == samples - 1] = "last"
    return ended


def _met(at: Array, radius: Array, sample: Ints, meeting: Bools) -> NDArray[np.object_]:
    """Which of the tracklets that end in a meeting, at (m, 2) px, have met each other: numbers in words."""
    met = np.full(len(at), "", object)
    who = np.flatnonzero(meeting)
    for i in who.tolist():
        near = np.hypot(*(at[who] - at[i]).T) < CERTAINTY.met_sizes * (radius[who] + radius[i]) + CERTAINTY.jump_px
        together = who[near & (np.abs(sample[who] - sample[i]) <= CERTAINTY.met_within) & (who != i)]
        met[i] = " ".join(str(k) for k in together.tolist())
    return met
