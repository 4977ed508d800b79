"""A few pixels of a picture, and by how much blocks of them differ from picture to picture."""

from __future__ import annotations

import cv2
import numpy as np

from vidtrack.arrays import Array
from vidtrack.timing.frame import Luma

WIDE = 960
"""px of width above which one pixel in 4 x 4 is looked at; else one in 2 x 2. A block is 4 x 4 of these."""


def step_of(luma: Luma) -> int:
    """One pixel in so many of a row is looked at, and one row in so many."""
    return 4 if luma.shape[1] > WIDE else 2


def every(luma: Luma, step: int) -> Luma:
    """Every step-th pixel of every step-th row, as many as make whole blocks.

    The first of pixels side by side is the lowest byte of one number: its cast is faster than a copy by steps.
    """
    rows, columns = luma.shape
    height, width = (4 * (-(-n // step) // 4) for n in (rows, columns))
    lowest = np.dtype(f"<u{step * luma.itemsize}")
    if luma.strides[1] != luma.itemsize or width * step > columns or lowest.itemsize > 8:
        return np.ascontiguousarray(luma[::step, ::step][:height, :width])
    return luma[: height * step : step, : width * step].view(lowest).astype(luma.dtype)


def by_block(a: Luma, b: Luma) -> Array:
    """Mean absolute difference (h/4, w/4) over blocks, grey levels, rounded.

    The sums are taken in halves of 32 bits, four pixels at a time.
    """
    four = cv2.absdiff(a, b).view(np.uint32)
    two = (four & 0xFF00FF) + (four >> 8 & 0xFF00FF)
    two = two[0::4] + two[1::4] + two[2::4] + two[3::4]
    return np.asarray(np.rint(((two & 0xFFFF) + (two >> 16)).astype(np.float32) / 16))
