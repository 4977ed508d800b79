"""How much worse a camera's calibration is at some places of its picture than at others, by its own covariance."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera, line_of_sight
from vidtrack.geometry.jacobian import columns, derivatives

GRID = (13, 9)
"""Places across and down the picture at which the covariance is carried to the picture."""
MOST = 10.0
"""Times the usual error, at most: where a covariance says more, it says nothing."""


def unevenness(camera: Camera, uncertainty: CameraUncertainty | None, b: Array) -> Array:
    """By how much worse than usual the calibration is in X and Y at places b (n, 2) px, at least 1; 1: as usual, or not
    known.

    Usual is the median over the places. Points are taken to be as far away as those of the calibration.
    """
    if uncertainty is None or not len(b):
        return np.ones(b.shape)
    x, y = (np.linspace(0, n - 1, k) for n, k in zip(camera.image_size, GRID, strict=True))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    eye, way = line_of_sight(camera, grid)
    p = eye + way * np.linalg.norm(uncertainty.pivot - camera.position) / np.linalg.norm(way, axis=-1, keepdims=True)
    J = derivatives(camera, p, uncertainty.pivot).by_parameter[..., columns(camera, uncertainty.names)]
    variance = np.einsum("nik,kl,nil->ni", J, uncertainty.covariance, J).reshape(*GRID, 2)
    at = [np.clip(own, 0, n - 1) / (n - 1) * (k - 1) for own, n, k in zip(b.T, camera.image_size, GRID, strict=True)]
    low = [np.minimum(own.astype(np.intp), k - 2) for own, k in zip(at, GRID, strict=True)]
    (u, v), (i, j) = (own - first for own, first in zip(at, low, strict=True)), low
    u, v = u[:, None], v[:, None]
    here = (variance[i, j] * (1 - u) + variance[i + 1, j] * u) * (1 - v)
    here += (variance[i, j + 1] * (1 - u) + variance[i + 1, j + 1] * u) * v
    known = np.isfinite(here).all(-1)
    if not known.any():
        return np.ones(b.shape)
    usual = np.median(here[known], axis=0)
    return np.where(known[:, None], np.sqrt(np.clip(here / np.maximum(usual, 1e-300), 1.0, MOST**2)), 1.0)
