"""Damage in pictures whose codec has no check sum: what is decoded behind it is wrong as far as the picture's end.

So the last row decides: where it differs from that of the picture before by far more than it usually does, and the
first row does not, or where it is far rougher than before, the picture is damaged. A change that lasts is none: the
row of the next picture is like it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.timing.frame import Luma

SEQUENTIAL = ("ffv1", "huffyuv", "ffvhuff", "utvideo", "lagarith", "mjpeg")
"""Codecs that code each picture by itself, from first row to last, without a check sum (FFV1 up to version 2)."""


@dataclass(frozen=True)
class Limits:
    """Grey levels of 255 (medians along a row), and multiples of what is usual."""

    change: float = 6.0
    times: float = 5.0
    rough: float = 6.0
    rougher: float = 2.5
    memory: float = 0.1


LIMITS = Limits()


class PictureEnds:
    """Compares the first and the last row of each picture with those of the picture before."""

    def __init__(self, bits: int) -> None:
        self._scale = 255.0 / (2**bits - 1)
        self._good: tuple[Array, Array] | None = None
        self._last: tuple[Array, Array] | None = None
        self._usual = 1.0

    def spoilt(self, luma: Luma) -> bool:
        """Whether the end of this picture, (height, width), is not what the camera saw."""
        rows = (luma[0].astype(np.float32) * self._scale, luma[-1].astype(np.float32) * self._scale)
        good, last, self._last = self._good, self._last, rows
        if good is None or last is None:
            self._good = rows
            return False
        top, bottom = (float(np.median(np.abs(now - before))) for now, before in zip(rows, good, strict=True))
        limit = max(LIMITS.change, LIMITS.times * self._usual)
        rougher = _roughness(rows[1]) > LIMITS.rougher * _roughness(good[1]) + LIMITS.rough
        if not (rougher or (bottom > limit and top < bottom / 2)):
            self._usual += LIMITS.memory * (bottom - self._usual)
            self._good = rows
            return False
        if float(np.median(np.abs(rows[1] - last[1]))) <= limit:  # it lasts: the scene has changed
            self._good = rows
            return False
        return True


PARTIAL = (*SEQUENTIAL, "prores")
"""Codecs whose decoders leave in memory what was there, where the data of a damaged picture end."""


class WholePictures:
    """Shows the latest whole picture in place of a damaged one, so that the same is read wherever it is read.

    codec  libavcodec's name; of those that are not PARTIAL every picture is shown as it is
    """

    def __init__(self, codec: str) -> None:
        self._partial = codec in PARTIAL
        self._latest: Luma | None = None

    def __call__(self, luma: Luma, *, corrupt: bool) -> Luma:
        """The picture, or the one that is shown instead; a black one where none was whole."""
        if not self._partial:
            return luma
        if corrupt:
            return np.zeros_like(luma) if self._latest is None else self._latest
        self._latest = luma
        return luma


def _roughness(row: Array) -> float:
    return float(np.median(np.abs(np.diff(row))))


def ends_are_checked(codec: str, extradata: bytes | None) -> bool:
    """Whether damage to a codec's pictures shows at their end alone; FFV1 with a header of its own has check sums."""
    return codec in SEQUENTIAL and not (codec == "ffv1" and extradata)
