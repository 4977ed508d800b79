"""What the tracker has measured, sample by sample: of its targets, and of all else that it followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.following.occlusion import recent
from vidtrack.tracking.state import MEASURED, POSITION, Rows


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
        self._blocks: list[Rows] = []
        self._others: list[Others] = []
        self._recent: list[tuple[Array, Array]] = []  # times, X and Y of every place
        self._track = np.zeros(0, np.intp)

    def __len__(self) -> int:
        return len(self._blocks)

    def append(self, block: Rows, times: Array, track: Ints) -> None:
        """Take in a block; track: the number of the track in each column, -1: none."""
        n = self.n
        new = track != self._track if self._track.size else np.zeros(track.size, bool)
        if new.any():  # positions of the track that had the place before
            self._recent = [(t, np.where(new, np.nan, values)) for t, values in self._recent]
        self._recent = [*self._recent[-24:], (times, block.values[POSITION])]
        self._track = track.copy()
        self._blocks.append(Rows(block.values[..., :n], block.corner[:, :n], block.flag[:, :n], block.total_pixels))
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

    def recent(self) -> tuple[Array, Array]:
        """Times (k,) and positions (k, places, 2) of the last samples; none before the first block."""
        if not self._recent:
            return np.zeros(0), np.zeros((0, 0, 2))
        times, values = zip(*self._recent, strict=True)
        return recent(times, values)

    def rows(self) -> Rows:
        """The targets."""
        if not self._blocks:
            n = self.n
            return Rows(np.zeros((MEASURED, 0, n)), np.zeros((0, n, 2)), np.zeros((0, n), np.int64), np.zeros(0))
        values = np.concatenate([block.values for block in self._blocks], axis=1)
        return Rows._make([values, *(np.concatenate(column) for column in list(zip(*self._blocks, strict=True))[1:])])

    def others(self) -> Others:
        """All else that was followed."""
        if not self._others:
            return Others(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((MEASURED, 0)), np.zeros(0, np.int64))
        track, sample, values, flag = zip(*self._others, strict=True)
        return Others(
            np.concatenate(track), np.concatenate(sample), np.concatenate(values, axis=1), np.concatenate(flag)
        )
