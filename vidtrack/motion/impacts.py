"""Where the velocity of a record jumps: a blow, a bounce, a line that snaps taut."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array

SIDE = 6
"""Samples on either side of an impact that show the velocity before and after it."""


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
    middle = np.arange(SIDE, len(t) - SIDE + 1)
    when = (t[middle - 1] + t[middle]) / 2
    before, after = (_slopes(t, y, w, middle + side, when) for side in (-SIDE, 0))
    size[middle] = np.abs(after[0] - before[0]) / (sd * np.sqrt(before[1] + after[1]))
    largest = np.array([size[max(k - SIDE + 1, 0) : k + SIDE].max() for k in range(len(t))])
    return np.where(size == largest, size, 0.0)


def _slopes(t: Array, y: Array, w: Array, first: NDArray[np.intp], when: Array) -> tuple[Array, Array]:
    """Slopes at `when` (m,) of parabolas through the six samples from each of `first` on, and their variances."""
    rows = first[:, None] + np.arange(SIDE)
    off = t[rows] - when[:, None]
    inverse = np.linalg.pinv(np.stack([np.ones(rows.shape), off, off**2], -1) * w[rows, None])[:, 1]
    wy = y[rows] * w[rows]
    slope = np.array([a @ b for a, b in zip(inverse, wy, strict=True)])
    return slope, np.array([a @ a for a in inverse])
