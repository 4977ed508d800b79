"""Rotations of vectors: Rodrigues' formula, for one and for many."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array


def rotation_from_vector(omega: ArrayLike) -> Array:
    """The rotations (..., 3, 3) by |omega| rad about the axes omega (..., 3).

    R = 1 + sin|omega| K + (1 - cos|omega|) K K, where K is the cross product with the unit axis.
    """
    w: Array = np.asarray(omega, float)
    angle = np.linalg.norm(w) if w.ndim == 1 else np.linalg.norm(w, axis=-1)[..., None, None]
    K = np.zeros((*w.shape, 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    K = K - np.swapaxes(K, -1, -2)
    # sinc keeps full precision for the smallest steps
    R: Array = np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)
    return R
