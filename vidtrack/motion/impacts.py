"""Where the velocity of a record jumps: a blow, a bounce, a line that snaps taut."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from vidtrack.arrays import Array

SIDE = 6
"""Samples on either side of an impact that show the velocity before and after it."""

AT_ONCE = 4096
"""Samples that are looked at at once."""


def velocity_jumps(t: Array, y: Array, weight: Array) -> Array:
    """By how many sd the velocity jumps between each sample (n,) and the one before it; 0 where it does not stand out.

    Parabolas through six samples on either side are compared half way between. Only the largest jump within six
    samples counts. A motion that is smooth at the sampling rate jumps nowhere.
    """
    size = np.zeros(len(t))
    if len(t) < 2 * SIDE:
        return size
    w = np.sqrt(weight)
    rough = np.abs(np.diff(y, 3)) * w[1:-2]
    sd = 1.4826 * float(np.median(rough)) / np.sqrt(20.0)  # of white noise; a smooth motion adds little
    if not sd > 1e-9 * float(np.abs(y * w).max()):  # rounding, no noise
        return size
    for first in range(SIDE, len(t) - SIDE + 1, AT_ONCE):
        middle = np.arange(first, min(first + AT_ONCE, len(t) - SIDE + 1))
        when = (t[middle - 1] + t[middle]) / 2
        before, after = (_slopes(t, y, w, middle + side, when) for side in (-SIDE, 0))
        size[middle] = np.abs(after[0] - before[0]) / (sd * np.sqrt(before[1] + after[1]))
    largest = sliding_window_view(np.pad(size, SIDE - 1), 2 * SIDE - 1).max(-1)
    return np.where(size == largest, size, 0.0)


def _slopes(t: Array, y: Array, w: Array, first: NDArray[np.intp], when: Array) -> tuple[Array, Array]:
    """Slopes at `when` (m,) of parabolas through the six samples from each of `first` on, and their variances."""
    rows = first[:, None] + np.arange(SIDE)
    off = (t[rows] - when[:, None]) / (t[rows[:, -1:]] - t[rows[:, :1]])
    constant, slope, bend = w[rows], w[rows] * off, w[rows] * off**2
    # What of the slope's column the other two do not hold: alone it decides the slope (Gram-Schmidt).
    with np.errstate(invalid="ignore", divide="ignore"):  # too few samples with weight: no slope
        constant = constant / np.sqrt((constant**2).sum(-1, keepdims=True))
        bend = bend - (bend * constant).sum(-1, keepdims=True) * constant
        bend /= np.sqrt((bend**2).sum(-1, keepdims=True))
        for other in (constant, bend):
            slope = slope - (slope * other).sum(-1, keepdims=True) * other
        own = (slope**2).sum(-1)
        extent = t[rows[:, -1]] - t[rows[:, 0]]
        return (slope * (y[rows] * w[rows])).sum(-1) / own / extent, 1 / own / extent**2
