"""Where the velocity of a record jumps: a blow, a bounce, a line that snaps taut."""

from __future__ import annotations

import numpy as np

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
    for k in range(SIDE, len(t) - SIDE + 1):
        when = (t[k - 1] + t[k]) / 2
        slopes, variance = [], 0.0
        for rows in (slice(k - SIDE, k), slice(k, k + SIDE)):
            A = np.stack([np.ones(SIDE), t[rows] - when, (t[rows] - when) ** 2], -1) * w[rows, None]
            inverse = np.linalg.pinv(A)
            slopes.append(inverse[1] @ (y[rows] * w[rows]))
            variance += float(inverse[1] @ inverse[1])
        size[k] = abs(slopes[1] - slopes[0]) / (sd * np.sqrt(variance))
    largest = np.array([size[max(k - SIDE + 1, 0) : k + SIDE].max() for k in range(len(t))])
    return np.where(size == largest, size, 0.0)
