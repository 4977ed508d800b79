"""A calibrated camera for notebooks: where it sees points, and along which lines it sees pixels."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array

if TYPE_CHECKING:
    from vidtrack.files.camera_json import Calibrated
    from vidtrack.geometry.camera import Camera


class CalibratedCamera:
    """A camera.json; it is read when it is first asked for.

    Positions are in the experiment's unit of length; pixels in the frame buffer: the centre of the top-left one is
    (0, 0), X right, Y down.
    """

    def __init__(self, path: str) -> None:
        self.path = path

    def __repr__(self) -> str:
        width, height = self.image_size
        place = np.round(self.position, 3).tolist()
        return f"<vidtrack camera {self.name}: {width} x {height} px, at {place} {self.units}>"

    @cached_property
    def _read(self) -> Calibrated:
        from vidtrack.files.camera_json import read_camera

        return read_camera(self.path)

    @property
    def camera(self) -> Camera:
        """Tsai's parameters, as `vidtrack.geometry.camera` takes them."""
        return self._read.camera

    @property
    def record(self) -> dict[str, Any]:
        """Every key of camera.json."""
        return self._read.record

    @property
    def name(self) -> str:
        return self.camera.name

    @property
    def units(self) -> str:
        """The unit of every length."""
        return str(self.record.get("units", ""))

    @property
    def image_size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self.camera.image_size

    @property
    def position(self) -> Array:
        """The perspective centre, (3,)."""
        return self.camera.position

    def project(self, points: ArrayLike) -> Array:
        """Frame buffer px (..., 2) where the camera sees world points (..., 3); NaN behind it."""
        from vidtrack.geometry.camera import project

        return project(self.camera, points)

    def line_of_sight(self, pixels: ArrayLike) -> tuple[Array, Array]:
        """The lines that frame buffer px (..., 2) see: where they start, (3,) or (..., 3); unit directions (..., 3)."""
        from vidtrack.geometry.camera import line_of_sight

        return line_of_sight(self.camera, pixels)

    lines_of_sight = line_of_sight

    def undistorted(self, pixels: ArrayLike) -> Array:
        """Frame buffer px (..., 2) without the lens's distortion, as a pinhole of the same f, Cx, Cy sees them."""
        from vidtrack.geometry.camera import frame_buffer_from_distorted, undistorted_from_frame_buffer

        pinhole = self.camera.without_lens().with_(projection="perspective", skew=self.camera.skew)
        return frame_buffer_from_distorted(pinhole, undistorted_from_frame_buffer(self.camera, pixels))
