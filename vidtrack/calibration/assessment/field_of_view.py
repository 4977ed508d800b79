"""How much of the world a picture covers at a given distance, and the lens and target that a field asks for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, camera_from_world, distorted_from_frame_buffer, undistorted_from_distorted


class Field(NamedTuple):
    """Width, height and diagonal of what the picture shows at one depth, world units."""

    width: float
    height: float
    diagonal: float


def field_of_view(camera: Camera, depth: float) -> Field:
    """The field through the middle of the picture, at a depth along the optical axis in world units.

    From edge to edge of the frame buffer (512 columns run from -0.5 to 511.5 px), the lens's distortion included
    as far as the model does not fold. The thesis's 8.8 x 6.6 mm sensor behind f = 11 mm covers 128 x 96 at 160.
    """
    columns, rows = camera.image_size
    middle = (columns - 1) / 2, (rows - 1) / 2
    edges = [(-0.5, middle[1]), (columns - 0.5, middle[1]), (middle[0], -0.5), (middle[0], rows - 0.5)]
    d = distorted_from_frame_buffer(camera, edges)
    u = undistorted_from_distorted(camera, d)
    u = np.where(np.isfinite(u), u, d) * depth / camera.f
    width, height = float(np.linalg.norm(u[1] - u[0])), float(np.linalg.norm(u[3] - u[2]))
    return Field(width, height, float(np.hypot(width, height)))


def diagonal_field(cameras: Sequence[Camera], p: ArrayLike) -> float:
    """The diagonal of the field at the calibration points, world units: the length by which the thesis judges errors.

    For each camera the field of view at the mean depth of the points p (n, 3); then the mean over the cameras.
    About 160 in for the thesis's rig, 128 in wide with a 4:3 picture.
    """
    return float(np.mean([field_of_view(camera, mean_depth(camera, p)).diagonal for camera in cameras]))


def mean_depth(camera: Camera, p: ArrayLike) -> float:
    """Mean distance of points p (n, 3) from the camera, along its optical axis, world units."""
    return float(np.nanmean(camera_from_world(camera, p)[..., 2]))


def pixels_across(camera: Camera, p: ArrayLike, diameter: float) -> Array:
    """The image's diameter (...), px, of a ball of this diameter (world units) at p (..., 3); the mean of X and Y.

    A 2 in ball that is 160 in from the thesis's camera is about 8 px across.
    """
    z = camera_from_world(camera, p)[..., 2]
    scale = camera.f * (camera.Sx / camera.dx + 1 / camera.dy) / 2
    return np.asarray(np.where(z > 0, scale * diameter / np.where(z > 0, z, 1), np.nan))
