"""What became of a recording while it was read: packets that failed, gaps in time, pictures that show nothing."""

from __future__ import annotations

from array import array
from fractions import Fraction

import numpy as np

from vidtrack.frame import Luma, ReadAccount, VideoInfo

_EVERY = 32
"""Every so many pictures one is looked at, and compared with the next: 0.02 ms a picture at 1080p."""


class Watch:
    """Keeps count while a recording is read, at a cost that hides behind the decoder."""

    def __init__(self) -> None:
        self._times = array("d")
        self._corrupt = array("q")
        self._failed: list[str] = []
        self._broken: str | None = None
        self._sizes: dict[tuple[int, int], int] = {}
        self._looked = self._blank = self._compared = self._repeated = 0
        self._before: Luma | None = None

    def picture(self, index: int, time: Fraction, luma: Luma, corrupt: bool) -> None:
        """One picture that was decoded."""
        self._times.append(time)
        if corrupt:
            self._corrupt.append(index)
        if self._before is not None:
            self._compared += 1
            self._repeated += np.array_equal(self._before, luma)
            self._before = None
        if index % _EVERY == 0:
            self._looked += 1
            self._blank += int(luma.max()) - int(luma.min()) <= (8 << max(0, 8 * luma.dtype.itemsize - 8) // 4)
            self._before = luma.copy()

    def failed_packet(self, error: Exception) -> None:
        """A packet that the decoder refused, with the pictures in it."""
        self._failed.append(str(error))

    def broken_off(self, error: Exception) -> None:
        """The container could not be read further."""
        self._broken = getattr(error, "strerror", None) or str(error)

    def other_size(self, index: int, width: int, height: int) -> None:
        """A picture of another size than the first, which is left out."""
        self._sizes[width, height] = self._sizes.get((width, height), 0) + 1

    def reason(self) -> str:
        """The first thing that went wrong, for an error message; empty when nothing did."""
        return next(iter([*self._failed, *([self._broken] if self._broken else [])]), "")

    def account(self, info: VideoInfo) -> ReadAccount:
        """The whole story."""
        return ReadAccount(len(self._times), len(self._failed), len(self._corrupt), ())
