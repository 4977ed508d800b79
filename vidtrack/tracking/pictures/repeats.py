"""Pictures that repeat the one before bit by bit: what they show was so one picture earlier.

Recorders fill dropped frames up with the picture before. A target that rests is measured in such a picture as well as
in any other; one that moves is not where the picture shows it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.timing.frame import Frame, Luma
from vidtrack.tracking.state import SD_X, SD_Y, Rows, X, Y


@dataclass(frozen=True)
class Resting:
    """How far, in sigmas and px, a target may be off in a repeated picture to be measured in it all the same."""

    sigmas: float = 3.0
    px: float = 0.05


RESTING = Resting()


class RepeatedPictures:
    """Compares each frame that passes with the one before; `flags`: which were the same, bit by bit, and `indices`."""

    def __init__(self) -> None:
        self.flags: list[bool] = []
        self.indices: set[int] = set()
        self._last: Luma | None = None

    def over(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames, unchanged."""
        for frame in frames:
            self.flags.append(self._last is not None and _same(self._last, frame.luma))
            if self.flags[-1]:
                self.indices.add(frame.index)
            self._last = frame.luma
            yield frame


def _same(a: Luma, b: Luma) -> bool:
    """Whether two pictures are the same; most that are not differ in a few rows already."""
    if a.shape != b.shape or not np.array_equal(a[:: 1 + len(a) // 8], b[:: 1 + len(b) // 8]):
        return False
    return bool(np.array_equal(a, b))


def with_resting(rows: Rows, repeated: Bools, lines: int) -> Rows:
    """The rows in which targets at rest are measured in samples (k,) that repeat those `lines` before, as they were.

    A target rests while it is, before and after the repeats, at the same place within its sd. Where no sample comes
    after, the last step before decides.
    """
    if not repeated.any():
        return rows
    values, flag, corner = rows.values.copy(), rows.flag.copy(), rows.corner.copy()
    for sample in np.flatnonzero(repeated).tolist():
        before = sample - lines  # repeats of repeats have been filled by now
        if before < 0:
            continue
        rest = _rests(values, repeated, sample, before)
        values[:, sample, rest], flag[sample, rest] = values[:, before, rest], flag[before, rest]
        corner[sample, rest] = corner[before, rest]
    return Rows(values, corner, flag, rows.total_pixels)


def _rests(values: Array, repeated: Bools, sample: int, before: int) -> Bools:
    """Which targets (n,) are where they were before the repeats when these are over."""
    later = np.flatnonzero(~repeated[sample:])
    earlier = np.flatnonzero(~repeated[:before])
    if later.size:
        other = sample + int(later[0])
    elif earlier.size:
        other = int(earlier[-1])
    else:
        other = before
    way = np.abs(values[[X, Y], other] - values[[X, Y], before])
    small = way <= np.maximum(RESTING.sigmas * values[[SD_X, SD_Y], before], RESTING.px)
    return np.asarray(np.all(small, axis=0))
