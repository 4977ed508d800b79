"""How far the plane in which a target moves leans out of the picture's own plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.jacobian import PARAMETERS
from vidtrack.geometry.pose import poses
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.location.one_camera.plane import holds

ASPECT_SD = 0.01
"""ASSUME: how well the width of a pixel over its height is known, as a share of it."""
SX = PARAMETERS.index("Sx")


class Tilt(NamedTuple):
    """The angle between the picture and the plane, degrees, and its standard deviation."""

    angle: float
    sd: float


def tilt(
    b: ArrayLike, p: ArrayLike, *, sd: float = 0.1, aspect: float = 1.0, image_size: tuple[int, int] | None = None
) -> Tilt:
    """How far the plane leans out of the picture's own plane; NaN for fewer than four points or points on a line.

    The thesis (4.2, after Wolf) allows a scale factor up to 3 degrees. The focal length is not known, so
    the camera is any that is likely (see `pose`): foreshortening bounds the angle, convergence refines it.

    b           (n, 2)  px; p (n, 2) world units; sd px
    image_size  px; without it, a picture just large enough for the points
    """
    pixels: Array = np.asarray(b, float) * np.array([aspect, 1.0])
    places: Array = np.asarray(p, float)
    good = np.isfinite(pixels).all(-1) & np.isfinite(places).all(-1)
    pixels, places = pixels[good], places[good]
    if len(pixels) < 4 or not holds("homography", pixels):
        return Tilt(np.nan, np.nan)
    width, height = image_size if image_size is not None else (pixels[:, 0].max() / aspect + 1, pixels[:, 1].max() + 1)
    world = np.column_stack([places, np.zeros(len(places))])
    found = poses(world, pixels, sd, (int(width * aspect), int(height)))
    if not found:
        return Tilt(np.nan, np.nan)
    camera, covariance = found[0].camera, found[0].covariance
    # The pose gives the pixels' shape only to 15 %; here the aspect is given, so its effect on the attitude goes too.
    gain = covariance[:, SX] / (covariance[SX, SX] + ASPECT_SD**2)
    R = rotation_from_vector(-gain[:3] * np.log(camera.Sx)) @ camera.R
    covariance = covariance - np.outer(gain, covariance[SX])
    across = np.hypot(R[0, 2], R[1, 2])  # sine of the angle between the optical axis and the plane's normal
    angle = np.arctan2(across, abs(R[2, 2]))
    # The normal in camera axes turns by omega x n: the angle changes by omega along the axis of tilting.
    axis = np.array([-R[1, 2], R[0, 2]]) / across if across > 0 else np.array([1.0, 0.0])
    return Tilt(float(np.degrees(angle)), float(np.degrees(np.sqrt(axis @ covariance[:2, :2] @ axis))))
