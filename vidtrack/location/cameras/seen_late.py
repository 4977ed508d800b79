"""Positions of a moment before: what a camera that averages its pictures shows late, by no one knows how much.

All cameras of a kind are late alike: their lines of sight meet, so that no residual shows it and the error is the
same in all samples, along the way that the target goes.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.triangulate import Located


def with_lateness(located: Located, at: Array, late_s: float) -> tuple[Located, Array]:
    """Positions (m, M) at moments `at` (M,) s with a covariance that holds that they are up to late_s seconds old; and
    what that adds to it, (m, M, 3, 3) world units squared.

    Where a target's velocity is not known at a moment, it is as fast as it is on average.
    """
    point, none = located.point, np.zeros((*located.point.shape, 3))
    if not late_s or at.size < 3:
        return located, none
    apart = min(max(round(late_s / float(np.median(np.diff(at)))), 1), (at.size - 1) // 2)  # less noise, the same way
    rate = np.full((2, *point.shape), np.nan)  # to the sample so far on, from that so far back
    step = (at[apart:] - at[:-apart])[:, None]
    rate[0, :, :-apart] = rate[1, :, apart:] = (point[:, apart:] - point[:, :-apart]) / step
    velocity = np.where(np.isfinite(rate[0]), rate[0], rate[1])
    both = np.isfinite(rate).all(axis=0)
    velocity[both] = rate.mean(axis=0)[both]
    acceleration = (rate[0] - rate[1]) / float(np.median(step))
    added = late_s**2 * _usually(velocity) + late_s**4 / 4 * _usually(acceleration)
    covariance = located.covariance + added
    sigma = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    return located._replace(covariance=covariance, sigma=sigma), added


def _usually(rate: Array) -> Array:
    """The products v v^T (m, M, 3, 3) of vectors (m, M, 3), where one is not known what they are on average."""
    square = rate[..., :, None] * rate[..., None, :]
    known = np.isfinite(square)
    mean = np.where(known, square, 0.0).sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    return np.where(known, square, mean)
