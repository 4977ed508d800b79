"""How a lens turns angles into distances on the sensor: in perspective, or equidistant as wide lenses do.

A lens without distortion puts a ray at the angle theta to the optical axis at Ru = f tan theta (perspective) or at
Re = f theta (equidistant; most lenses beyond 100 degrees, fisheyes). The polynomial lens terms act on either: an
equidistant camera's terms lead from distorted to equidistant positions, and from there

    (Xu, Yu) = (Xe, Ye) tan(Re / f) / (Re / f)

to those of a pinhole, which exist for angles below 90 degrees. Kannala and Brandt (2006) write the same lens from
undistorted to distorted.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from vidtrack.arrays import Array

Projection = Literal["perspective", "equidistant"]

WIDEST = np.pi / 2 * (1 - 1e-9)
"""rad from the optical axis; no pinhole sees farther."""

SMALL = 1e-4
"""rad, below which the series is exact to 1e-16."""


def perspective_from_equidistant(e: Array, f: float) -> Array:
    """Pinhole positions (..., 2) of equidistant ones (..., 2), unit of f; NaN from 90 degrees on."""
    theta = np.hypot(e[..., 0], e[..., 1]) / f
    return np.asarray(e * _stretch(theta)[..., None])


def equidistant_from_perspective(u: Array, f: float) -> Array:
    """The inverse: equidistant positions (..., 2) of pinhole ones."""
    tangent = np.hypot(u[..., 0], u[..., 1]) / f
    with np.errstate(divide="ignore", invalid="ignore"):
        shrink = np.where(tangent < SMALL, 1 - tangent**2 / 3, np.arctan(tangent) / tangent)
    return np.asarray(u * shrink[..., None])


def perspective_jacobian(e: Array, f: float) -> Array:
    """d(Xu, Yu)/d(Xe, Ye), (..., 2, 2), no unit, at equidistant positions e (..., 2)."""
    theta = np.hypot(e[..., 0], e[..., 1]) / f
    stretch = _stretch(theta)
    with np.errstate(divide="ignore", invalid="ignore"):
        # d(tan t / t)/dt / t, which is 2/3 on the axis
        slope = np.where(theta < SMALL, 2 / 3, (1 / np.cos(theta) ** 2 - stretch) / theta**2) / f**2
    J = slope[..., None, None] * e[..., :, None] * e[..., None, :]
    J[..., 0, 0] += stretch
    J[..., 1, 1] += stretch
    return np.asarray(J)


def perspective_by_f(e: Array, f: float) -> Array:
    """d(Xu, Yu)/df, (..., 2), no unit, for fixed equidistant positions e (..., 2)."""
    theta = np.hypot(e[..., 0], e[..., 1]) / f
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.where(theta < SMALL, -2 / 3 * theta**2, _stretch(theta) - 1 / np.cos(theta) ** 2)
    return np.asarray(e / f * gain[..., None])


def _stretch(theta: Array) -> Array:
    """tan(theta) / theta; NaN from 90 degrees on."""
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(theta < SMALL, 1 + theta**2 / 3, np.tan(theta) / theta)
    return np.where(theta < WIDEST, value, np.nan)
