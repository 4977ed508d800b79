"""A camera's lens for programs that go from undistorted to distorted positions, with what the refit leaves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import Run
from vidtrack.geometry.brown import BrownLens, distorted, undistorted
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.lens_conversion import brown_from_camera

GRID = 33
"""Positions along each side of the picture at which lenses are compared."""


class Refitted(NamedTuple):
    """The lens of a camera as another program takes it, and the largest distance, px, from ours over the picture."""

    name: str
    camera: Camera
    lens: BrownLens
    largest_px: float


def refitted(run: Run, *, radial: int = 3, wide: bool = True, skew: bool = False) -> list[Refitted]:
    """The cameras of a run, or of the calibration, in the order of their names.

    radial   radial terms of a lens that is not wide; wide ones have four
    wide     whether the format has fisheye lenses; skew: whether it has skew
    VidtrackError for a camera that looks through interfaces, or a lens that the format does not have.
    """
    if not run.cameras:
        raise VidtrackError("no calibrated camera. Call vidtrack run first.")
    return [_one(camera, radial, wide, skew) for _, camera in sorted(run.cameras.items())]


def notes_of(cameras: list[Refitted]) -> list[str]:
    """What each refit leaves."""
    return [f"{own.name}: the refitted lens is within {own.largest_px:.3g} px over the picture" for own in cameras]


def straight(camera: Camera) -> Camera:
    """The camera; VidtrackError where it looks through interfaces, which these formats do not have."""
    if camera.through:
        raise VidtrackError(
            f"camera {camera.name}: it looks through interfaces, which the format does not have. Export csv or netcdf."
        )
    return camera


def _one(camera: Camera, radial: int, wide: bool, skew: bool) -> Refitted:
    fisheye = straight(camera).projection == "equidistant"
    if fisheye and not wide:
        raise VidtrackError(f"camera {camera.name}: its lens is equidistant, and the format has no such lens.")
    lens = brown_from_camera(camera, radial=4 if fisheye else radial).lens
    if not skew:
        lens = lens._replace(skew=0.0)
    return Refitted(camera.name, camera, lens, largest_error(camera, lens))


def largest_error(camera: Camera, lens: BrownLens) -> float:
    """The largest distance, px, between what a camera and a lens at its place see, over what the camera sees."""
    width, height = camera.image_size
    X, Y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID), np.linspace(-0.5, height - 0.5, GRID))
    x = undistorted(lens, np.stack([X, Y], -1))
    here = camera.with_(R=np.eye(3), T=np.zeros(3))
    off = np.linalg.norm(distorted(lens, x) - project(here, np.concatenate([x, np.ones((*X.shape, 1))], -1)), axis=-1)
    if not np.isfinite(off).any():
        raise VidtrackError(f"camera {camera.name}: the format's lens cannot follow it. Export csv or netcdf.")
    return float(np.nanmax(off))
