"""The way of light from what a pixel sees to the camera, in the camera's medium and behind each interface."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, directions
from vidtrack.geometry.refraction import paths


def along_path(camera: Camera, b: ArrayLike, distance: ArrayLike) -> Array:
    """World points (n, 3) that the camera sees at one frame buffer position b (2,), at distances (n,) along the light's
    path from the camera, world units."""
    distance = np.asarray(distance, float)
    path = paths(camera.through, camera.position, directions(camera, b))
    starts = np.array([rays.q[:, 0] for rays in path])
    legs = [0.0, *(float(np.linalg.norm(b.q - a.q)) for a, b in pairwise(path))]
    begins = np.cumsum(legs)
    part = np.maximum(np.searchsorted(begins, distance, "right") - 1, 0)
    ahead = np.array([rays.d[:, 0] for rays in path])[part]
    return np.asarray(starts[part] + (distance - begins[part])[:, None] * ahead)
