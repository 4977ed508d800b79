"""The floor: how well a point can be located by cameras that are perfectly known, for a given centroid noise.

A calibration can only add to it, so the held-out error over the floor is what calibration still costs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.normal_equations import linearised
from vidtrack.geometry.camera import Camera

CHI3_MEAN = np.sqrt(8 / np.pi)
"""Mean length of a 3-D Gaussian vector of unit variance a coordinate: 1.596."""

NORMAL_MEAN_ABS = np.sqrt(2 / np.pi)
"""Mean magnitude of a Gaussian number of unit variance: 0.798."""


def located_covariance(cameras: Sequence[Camera], p: ArrayLike, sd: ArrayLike, seen: ArrayLike | None = None) -> Array:
    """Covariance (n, 3, 3), world units^2, of points located at p (n, 3) by perfectly known cameras.

    sd    px, centroid noise of one coordinate: a number, or for m cameras whatever spreads to (m, n, 2)
    seen  (m, n) which camera sees which point; default: wherever it projects inside or outside the picture
    (sum over the cameras of B^T B / sd^2)^-1, B = d(Xf, Yf)/dp. NaN where fewer than two cameras see the point.
    """
    p = np.asarray(p, float)
    view = linearised(cameras, p, p.mean(0))
    visible = np.asarray(np.isfinite(view.projected).all(-1))
    if seen is not None:
        visible = visible & np.asarray(seen, bool)
    B = np.where(visible[..., None, None], view.by_point, 0.0)
    B = B / np.broadcast_to(np.asarray(sd, float), view.projected.shape)[..., None]
    information = (B.swapaxes(-1, -2) @ B).sum(0)
    fixed = visible.sum(0) >= 2
    information[~fixed] = np.eye(3)
    return np.where(fixed[:, None, None], np.linalg.inv(information), np.nan)


def mean_length(covariance: ArrayLike) -> Array:
    """Mean length (...) of a Gaussian error with covariance (..., 3, 3): no closed form, so a sum over directions.

    E|x| = sqrt(8/pi) times the mean of sqrt(u^T C u) over directions u, exact for any Gaussian.
    A covariance of s^2 I gives 1.596 s; one direction alone, 0.798 s. NaN gives NaN.
    """
    C = np.asarray(covariance, float)
    lost = ~np.isfinite(C).all((-2, -1))
    variances = np.maximum(np.linalg.eigvalsh(np.where(lost[..., None, None], np.eye(3), C)), 0)
    return np.where(lost, np.nan, CHI3_MEAN * np.sqrt(variances @ _DIRECTIONS.T) @ _SHARES)


def _octant(k: int = 16) -> tuple[Array, Array]:
    """Squares (k*k, 3) of the components of directions over one octant, and their shares of it (k*k,)."""
    node, share = np.polynomial.legendre.leggauss(k)
    cosine, angle = (node + 1) / 2, (node + 1) * np.pi / 4
    c2, a = (part.ravel() for part in np.meshgrid(cosine**2, angle, indexing="ij"))
    squares = np.stack([(1 - c2) * np.cos(a) ** 2, (1 - c2) * np.sin(a) ** 2, c2], -1)
    return squares, np.outer(share / 2, share / 2).ravel()


_DIRECTIONS, _SHARES = _octant()
