"""Willson's four measures of how well one camera fits its calibration points.

Two are distances in the picture, before and after the lens's distortion is taken out; one is a distance in the
world; the last compares the error with what the finite size of a pixel alone would cause, so that cameras and
distances of every kind can be compared.
Sources: Willson's Tsai implementation (1995); Weng, Cohen and Herniou (1992).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    frame_buffer_from_distorted,
    line_of_sight,
    project,
    undistorted_from_camera,
    undistorted_from_frame_buffer,
)


class Summary(NamedTuple):
    """Mean, standard deviation (n - 1), maximum and sum of squares of n errors."""

    mean: float
    sd: float
    max: float
    sse: float
    n: int


class Measures(NamedTuple):
    """The four measures, each summed up over the points."""

    distorted: Summary  # px
    undistorted: Summary  # px
    object_space: Summary  # world units
    normalised: Summary  # no unit


def measures(camera: Camera, p: ArrayLike, b: ArrayLike) -> Measures:
    """Willson's measures of a camera that sees world points p (..., 3) at b (..., 2) px; NaN is passed over."""
    return Measures(
        summary(np.linalg.norm(distorted_error(camera, p, b), axis=-1)),
        summary(np.linalg.norm(undistorted_error(camera, p, b), axis=-1)),
        summary(object_space_error(camera, p, b)),
        summary(normalised_error(camera, p, b)),
    )


def summary(errors: ArrayLike) -> Summary:
    """Sum up errors without a sign; NaN is passed over, and answers NaN where nothing is left."""
    e = np.asarray(errors, float)
    e = e[np.isfinite(e)]
    if not e.size:
        return Summary(np.nan, np.nan, np.nan, np.nan, 0)
    sd = float(e.std(ddof=1)) if e.size > 1 else 0.0
    return Summary(float(e.mean()), sd, float(e.max()), float((e * e).sum()), int(e.size))


def distorted_error(camera: Camera, p: ArrayLike, b: ArrayLike) -> Array:
    """Measured minus projected position, (..., 2) px: the reprojection error."""
    return np.asarray(b, float) - project(camera, p)


def undistorted_error(camera: Camera, p: ArrayLike, b: ArrayLike) -> Array:
    """Measured minus pinhole position, (..., 2) px, the lens's distortion taken out of the measured one.

    Small values are no proof of a good lens model: a lens that shrinks the picture shrinks them too.
    """
    measured = undistorted_from_frame_buffer(camera, b)
    pinhole = undistorted_from_camera(camera, camera_from_world(camera, p))
    return frame_buffer_from_distorted(camera, measured) - frame_buffer_from_distorted(camera, pinhole)


def object_space_error(camera: Camera, p: ArrayLike, b: ArrayLike) -> Array:
    """Distance (...), world units, of each point from the line of sight through its measured position."""
    origin, direction = line_of_sight(camera, b)
    return np.asarray(np.linalg.norm(np.cross(np.asarray(p, float) - origin, direction), axis=-1))


def normalised_error(camera: Camera, p: ArrayLike, b: ArrayLike) -> Array:
    """Weng's error (...), no unit: 1 is what rounding to whole pixels would cause.

    The measured position is carried back to the point's own depth z, and its distance there is divided by the
    standard deviation of a pixel of that depth, z sqrt((1/fu^2 + 1/fv^2)/12), where fu = Sx f/dx and fv = f/dy.
    A rms error of .0894 px, as in Willson's sample, is a mean normalised error of .194.
    """
    c = camera_from_world(camera, p)
    carried = c[..., 2:] * undistorted_from_frame_buffer(camera, b) / camera.f
    fu, fv = camera.Sx * camera.f / camera.dx, camera.f / camera.dy
    pixel = c[..., 2] * np.sqrt((fu**-2 + fv**-2) / 12)
    return np.asarray(np.linalg.norm(carried - c[..., :2], axis=-1) / pixel)
