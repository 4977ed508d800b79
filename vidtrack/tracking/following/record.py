"""What the tracker has measured, sample by sample: of its targets, and of all else that it followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.following.occlusion import recent
from vidtrack.tracking.state import LOST, MEASURED, MERGED, POSITION, PREDICTED, Rows, TargetState


@dataclass(frozen=True)
class Blocks:
    """How blocks of samples are put together.

    together  parts of other tracks after which they are copied into one; each alone takes seven times its numbers
    samples   of the targets for which memory is taken at once; what is not filled yet costs none
    """

    together: int = 256
    samples: int = 4096


BLOCKS = Blocks()


class _Sheets:
    """Rows of n targets, written into memory for many samples at once, so that nothing is copied to join blocks."""

    def __init__(self, n: int) -> None:
        self._n, self._full = n, list[Rows]()
        self._open, self._filled = self._sheet(0), 0

    def _sheet(self, samples: int) -> Rows:
        n = self._n
        values, corner = np.empty((MEASURED, samples, n)), np.empty((samples, n, 2))
        return Rows(values, corner, np.empty((samples, n), np.int64), np.empty(samples))

    def append(self, block: Rows) -> None:
        """Take in a block, whose first n columns are the targets."""
        k, first = len(block.flag), 0
        while first < k:
            if self._filled == len(self._open.flag):
                self._close()
                self._open, self._filled = self._sheet(BLOCKS.samples), 0
            some = min(k - first, len(self._open.flag) - self._filled)
            to, of, n = slice(self._filled, self._filled + some), slice(first, first + some), self._n
            self._open.values[:, to] = block.values[:, of, :n]
            self._open.corner[to], self._open.flag[to] = block.corner[of, :n], block.flag[of, :n]
            self._open.total_pixels[to] = block.total_pixels[of]
            self._filled, first = self._filled + some, first + some

    def _close(self) -> None:
        """What is filled of the open sheet is one that is full."""
        if self._filled:
            self._full.append(_first(self._open, self._filled))

    def whole(self) -> Rows:
        """All of them; what is changed in it is changed here too."""
        if not self._full:
            return _first(self._open, self._filled)
        self._close()
        self._open, self._filled = self._sheet(0), 0
        if len(self._full) > 1:
            values, *columns = zip(*self._full, strict=True)
            self._full = [Rows._make([np.concatenate(values, axis=1), *(np.concatenate(c) for c in columns)])]
        return self._full[0]


def _first(rows: Rows, k: int) -> Rows:
    """The first k samples."""
    return Rows(rows.values[:, :k], rows.corner[:k], rows.flag[:k], rows.total_pixels[:k])


class _Pile:
    """Parts of other tracks, of which many small ones are soon joined, so that nothing they were cut from is held."""

    def __init__(self) -> None:
        self._joined, self._loose = list[Others](), list[Others]()

    def append(self, part: Others) -> None:
        self._loose.append(part)
        if len(self._loose) == BLOCKS.together:
            self._joined.append(_joined(self._loose))
            self._loose = []

    def whole(self) -> Others | None:
        """All parts as one; None where there are none."""
        parts = [*self._joined, *self._loose]
        if not parts:
            return None
        self._joined, self._loose = [_joined(parts)], []
        return self._joined[0]


class Others(NamedTuple):
    """Samples (N,) of tracks that are none of the targets', in order of time.

    track   number of the track; sample: number of the sample
    values  (MEASURED, N), NaN where the track was lost for a while; flag (N,) bits of FLAGS
    """

    track: Ints
    sample: Ints
    values: Array
    flag: NDArray[np.int64]


class Record:
    """Collects blocks of samples of n targets and of the tracks that follow them in the columns behind."""

    def __init__(self, n: int) -> None:
        self.n, self.samples = n, 0
        self._count = 0
        self._rows, self._others = _Sheets(n), _Pile()
        self._recent: list[tuple[Array, Array]] = []  # times, X and Y of every place
        self._track = np.zeros(0, np.intp)

    def __len__(self) -> int:
        return self._count

    def append(self, block: Rows, times: Array, track: Ints) -> None:
        """Take in a block; track: the number of the track in each column, -1: none."""
        n = self.n
        new = track != self._track if self._track.size else np.zeros(track.size, bool)
        if new.any():  # positions of the track that had the place before
            self._recent = [(t, np.where(new, np.nan, values)) for t, values in self._recent]
        self._recent = [*self._recent[-24:], (times, block.values[POSITION])]
        self._track = track.copy()
        self._rows.append(block)
        if (who := np.flatnonzero(track[n:] >= 0) + n).size:
            k = len(times)
            self._others.append(
                Others(
                    np.tile(track[who], k),
                    np.repeat(self.samples + np.arange(k), who.size),
                    block.values[..., who].reshape(MEASURED, -1),
                    block.flag[:, who].ravel(),
                )
            )
        self.samples += len(times)
        self._count += 1

    def unmeasured(self, track: int, samples: Ints) -> None:
        """What was measured of a track in these samples was not of one target."""
        if track < self.n:
            rows = self.rows()
            some = samples[np.isfinite(rows.values[0, samples, track])]
            rows.values[:, some, track] = np.nan
            rows.flag[some, track] = MERGED | PREDICTED
        else:
            others = self.others()
            own = (others.track == track) & np.isin(others.sample, samples)
            others.values[:, own], others.flag[own] = np.nan, MERGED | PREDICTED

    def of_track(self, track: int) -> tuple[Ints, Array]:
        """Samples (k,) and values (MEASURED, k) of a track."""
        if track < self.n:
            values = self.rows().values[:, :, track]
            return np.arange(values.shape[1]), values
        others = self.others()
        own = others.track == track
        return others.sample[own], others.values[:, own]

    def recent(self) -> tuple[Array, Array]:
        """Times (k,) and positions (k, places, 2) of the last samples; none before the first block."""
        if not self._recent:
            return np.zeros(0), np.zeros((0, 0, 2))
        times, values = zip(*self._recent, strict=True)
        return recent(times, values)

    def rows(self) -> Rows:
        """The targets."""
        return self._rows.whole()

    def others(self) -> Others:
        """All else that was followed."""
        none = Others(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((MEASURED, 0)), np.zeros(0, np.int64))
        return self._others.whole() or none


def _joined(parts: Sequence[Others]) -> Others:
    track, sample, values, flag = zip(*parts, strict=True)
    return Others(np.concatenate(track), np.concatenate(sample), np.concatenate(values, axis=1), np.concatenate(flag))


def blank_rows(predicted: Array, state: TargetState) -> Rows:
    """Rows in which every target is lost, its box where it is expected, (k, n, 2) px."""
    k, n = predicted.shape[:2]
    flag = np.full((k, n), LOST | PREDICTED, np.int64)
    corner = predicted - state.box / 2
    unborn = state.missing < 0
    if unborn.any():
        flag[:, unborn] = LOST
        corner[:, unborn] = np.nan
    return Rows(np.full((MEASURED, k, n), np.nan), corner, flag, np.zeros(k))
