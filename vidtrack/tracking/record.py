"""What the tracker has measured, sample by sample: of its targets, and of all else that it followed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.following.occlusion import recent
from vidtrack.tracking.state import MEASURED, MERGED, POSITION, PREDICTED, Rows


@dataclass(frozen=True)
class Blocks:
    """together: blocks of samples after which they are copied into one; each alone takes seven times its numbers."""

    together: int = 256


BLOCKS = Blocks()

Part = TypeVar("Part")


class _Pile(Generic[Part]):
    """Parts of which many small ones are soon joined to one, so that nothing of what they were cut from is held."""

    def __init__(self, join: Callable[[Sequence[Part]], Part]) -> None:
        self._join, self._joined = join, list[Part]()
        self._loose: list[Part] = []

    def append(self, part: Part) -> None:
        self._loose.append(part)
        if len(self._loose) == BLOCKS.together:
            self._joined.append(self._join(self._loose))
            self._loose = []

    def whole(self) -> Part | None:
        """All parts as one; None where there are none."""
        parts = [*self._joined, *self._loose]
        if not parts:
            return None
        self._joined, self._loose = [self._join(parts)], []
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
        self._rows, self._others = _Pile(_joined_rows), _Pile(_joined_others)
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
        self._rows.append(Rows(block.values[..., :n], block.corner[:, :n], block.flag[:, :n], block.total_pixels))
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
        n = self.n
        none = Rows(np.zeros((MEASURED, 0, n)), np.zeros((0, n, 2)), np.zeros((0, n), np.int64), np.zeros(0))
        return self._rows.whole() or none

    def others(self) -> Others:
        """All else that was followed."""
        none = Others(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((MEASURED, 0)), np.zeros(0, np.int64))
        return self._others.whole() or none


def _joined_rows(blocks: Sequence[Rows]) -> Rows:
    values, *columns = zip(*blocks, strict=True)
    return Rows._make([np.concatenate(values, axis=1), *(np.concatenate(column) for column in columns)])


def _joined_others(parts: Sequence[Others]) -> Others:
    track, sample, values, flag = zip(*parts, strict=True)
    return Others(np.concatenate(track), np.concatenate(sample), np.concatenate(values, axis=1), np.concatenate(flag))
