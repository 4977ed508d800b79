"""Tracklets: stretches of one camera's samples in which the identity of what is followed is certain.

The track stage writes them, a row a sample, to results/runs/<run>/tracklets/<camera>.parquet. A tracklet ends where
certainty ends and another one begins afterwards; which of them show one target is decided over all cameras together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints

COLUMNS = (
    "tracklet",  # its number, from 0, unique in a camera's table; -1: a detection that belongs to no tracklet
    "frame",  # as in the centroid table, as are field, time_s, Xf, Yf, sd_x, sd_y, pixels and flag
    "field",
    "time_s",
    "Xf",
    "Yf",
    "sd_x",
    "sd_y",
    "pixels",
    "brightness",  # mean grey level of its pixels over the background, NaN where it is not known
    "flag",
    "began",  # why the tracklet begins with its first row, one of BEGAN; the same in all its rows, as are ended and met
    "ended",  # why it ends with its last row, one of ENDED
    "met",  # numbers of the tracklets that took part in the meeting that ended it, with spaces between; else empty
    "target",  # name of the target that the track stage took it for; empty: none
    "bound",  # whether it begins in a start box of the user, so that `target` is certain
)
"""Columns of a table of tracklets, one row a sample in which the target was measured, by tracklet and then by time."""

BEGAN = ("first", "found", "meeting", "lost", "jump", "looks")
"""first: with the recording; found: at any time later; meeting: it comes out of one; lost: seen again after a gap;
jump, looks: the one before ended so, one sample earlier."""

ENDED = ("last", "lost", "edge", "meeting", "jump", "looks")
"""last: with the recording; lost: not seen any more; edge: it left the picture; meeting: it touches another target;
jump: the next position is not where it can be; looks: size or brightness change as no single target's do."""

LONGEST_GAP = 2
"""Samples in a row that may be missing inside a tracklet that is made from a track."""


class Tracklets(NamedTuple):
    """The n tracklets of one camera; tracklet k holds rows start[k] to start[k + 1] of the N measured samples."""

    start: Ints  # (n + 1,)
    sample: Ints  # (N,) index of the moment, rising within a tracklet
    b: Array  # (N, 2) px
    sd: Array  # (N, 2) px

    @property
    def n(self) -> int:
        """How many tracklets there are."""
        return len(self.start) - 1

    @property
    def owner(self) -> Ints:
        """(N,) the tracklet of each row."""
        return np.repeat(np.arange(self.n), np.diff(self.start))

    @property
    def first(self) -> Ints:
        """(n,) index of the first moment of each tracklet."""
        return self.sample[self.start[:-1]]

    @property
    def last(self) -> Ints:
        """(n,) index of the last moment of each tracklet."""
        return self.sample[self.start[1:] - 1]


def tracklets_of(owner: Sequence[int] | Ints, sample: Ints, b: Array, sd: Array) -> Tracklets:
    """Tracklets from rows in any order; `owner` (N,) numbers them from 0 without a gap, -1: the row belongs to none."""
    numbers = np.asarray(owner, np.intp)
    order = np.lexsort((sample, numbers))
    order = order[numbers[order] >= 0]
    counts = np.bincount(numbers[order]) if order.size else np.zeros(0, np.intp)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
    return Tracklets(start, np.asarray(sample, np.intp)[order], b[order], sd[order])


def lanes(first: Ints, last: Ints) -> Ints:
    """A lane (n,) for each tracklet from its first to its last moment, so that those of one are two moments apart."""
    out = np.zeros(len(first), np.intp)
    free: list[int] = []  # the last moment of each lane
    for k in np.argsort(first, kind="stable").tolist():
        lane = next((i for i, end in enumerate(free) if end + 2 <= first[k]), len(free))
        free[lane : lane + 1] = [int(last[k])]
        out[k] = lane
    return out


def pieces_of(b: Array, broken: Bools | None = None) -> Ints:
    """The tracklet (n, M), numbered from 0, that each sample of tracks b (n, M, 2) px is of; -1 where it is lost.

    broken   (n, M) samples at which a track may have changed over to another target: a tracklet begins there
    A track is also broken where more than LONGEST_GAP samples in a row are missing.
    """
    out = np.full(b.shape[:2], -1, np.intp)
    track, sample = np.nonzero(np.isfinite(b).all(-1))
    new = np.ones(track.size, bool)
    new[1:] = (np.diff(track) != 0) | (np.diff(sample) > LONGEST_GAP + 1)
    if broken is not None:
        # a change anywhere since the track's last measured sample breaks it there
        changes = np.cumsum(broken, axis=1)[track, sample]
        new[1:] |= (np.diff(changes) != 0) & (np.diff(track) == 0)
    out[track, sample] = np.cumsum(new) - 1
    return out


def may_change(flag: NDArray[np.object_]) -> Bools:
    """Samples (n, M) at which a track may have changed over to another target, from the flags of a centroid table.

    Those in which it was one with another, and the first after a gap that was found by a wider search.
    """
    merged, again, lost = (_says(flag, word) for word in ("merged", "recovered", "lost"))
    after = np.zeros(flag.shape, bool)
    after[:, 1:] = (lost | merged)[:, :-1]
    return np.asarray(merged | (again & after))


def _says(flag: NDArray[np.object_], word: str) -> Bools:
    kinds, which = np.unique(flag.astype(str), return_inverse=True)
    return np.asarray(np.array([word in kind for kind in kinds], bool)[which].reshape(flag.shape))


class Ends(NamedTuple):
    """m tracklets of regular tracks, N samples: see `ends_of_tracks`."""

    row: Ints  # (N,) of a table that has a row a moment and target, by moment
    number: Ints  # (N,) the tracklet of each sample
    began: NDArray[np.str_]  # (m,) one of BEGAN; ended (m,) one of ENDED
    ended: NDArray[np.str_]


def ends_of_tracks(b: Array) -> Ends:
    """The tracklets of tracks b (k, n, 2) px that never meet: one ends where its target is missing for long."""
    k, n = b.shape[:2]
    piece = pieces_of(np.swapaxes(b, 0, 1))
    target, sample = np.nonzero(piece >= 0)
    number = piece[target, sample]
    m = int(number.max(initial=-1)) + 1
    first, last = np.full(m, k), np.full(m, -1)
    np.minimum.at(first, number, sample)
    np.maximum.at(last, number, sample)
    owner = np.zeros(m, np.intp)
    owner[number] = target
    before = np.zeros(m, bool)
    before[1:] = owner[1:] == owner[:-1]
    began = np.where(first == 0, "first", np.where(before, "lost", "found"))
    return Ends(sample * n + target, number, began, np.where(last == k - 1, "last", "lost"))
