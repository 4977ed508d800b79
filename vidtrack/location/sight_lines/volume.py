"""Whether points lie inside the volume that the calibration points span; far outside it a calibration fails."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array


def distance_outside(volume: ArrayLike, p: ArrayLike) -> Array | None:
    """How far points (..., 3) lie outside the convex hull of `volume` (n, 3), world units; 0 inside, NaN for NaN.

    The distance is to the farthest face's plane: near an edge or a corner the true one is somewhat larger.
    None where the points span no volume: fewer than four, or all in one plane.
    """
    v, p = np.asarray(volume, float), np.asarray(p, float)
    v = v[np.isfinite(v).all(-1)]
    if len(v) < 4:
        return None
    spread = np.linalg.svd(v - v.mean(0), compute_uv=False)
    if spread[2] < 1e-6 * spread[0]:
        return None
    from scipy.spatial import ConvexHull

    faces = ConvexHull(v).equations
    outside = np.full(p.shape[:-1], -np.inf)
    for face in faces:  # a few hundred at most; points by faces would not fit in memory
        np.maximum(outside, p @ face[:3] + face[3], out=outside)
    return np.asarray(np.maximum(outside, 0.0))
