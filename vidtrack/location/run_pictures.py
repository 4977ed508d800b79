"""The calibration of a run's cameras as the run's pictures have it, where those are of another size or part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.window import Picture, Window, window


class Pictures(NamedTuple):
    """One camera's pictures: that of its calibration, that of the run, and the part that the config says it shows."""

    calibration: Picture
    run: Picture
    crop: Sequence[float] | None = None


class Uncertain(NamedTuple):
    """How well a camera is known, for another picture of it."""

    names: tuple[str, ...]
    pivot: Array  # (3,)
    covariance: Array  # (k, k)


def windows(pictures: Mapping[str, Pictures], where: str) -> tuple[dict[str, Window], list[Finding]]:
    """The window of every camera whose run shows another picture than its calibration; what was assumed."""
    shown, findings = {}, []
    for camera, own in pictures.items():
        part, found = window(own.calibration, own.run, own.crop, camera=camera, where=where)
        findings += found
        if part is not None:
            shown[camera] = part
    return shown, findings


def camera_shown(
    camera: Camera, uncertainty: CameraUncertainty | None, part: Window | None
) -> tuple[Camera, CameraUncertainty | None]:
    """A camera and how well it is known, as the window's picture has them."""
    if part is None:
        return camera, uncertainty
    known = None
    if uncertainty is not None:
        names = tuple(uncertainty.names)
        known = Uncertain(names, uncertainty.pivot, part.covariance(names, uncertainty.covariance))
    return part.camera(camera), known


def points_shown(points: pd.DataFrame, part: Window | None) -> pd.DataFrame:
    """A table of sights (Xf, Yf, sd_x, sd_y in px), as the window's picture has them."""
    if part is None:
        return points
    b = part.seen(points[["Xf", "Yf"]].to_numpy(float))
    moved = points.assign(Xf=b[:, 0], Yf=b[:, 1])
    scales = dict(zip(("sd_x", "sd_y"), part.scale, strict=True))
    return moved.assign(**{name: moved[name] * by for name, by in scales.items() if name in moved})


def centroids_in_calibration(centroids: pd.DataFrame, part: Window | None) -> pd.DataFrame:
    """A table of what the run shows (Xf, Yf, sd_x, sd_y in px), in the calibration's picture."""
    if part is None:
        return centroids
    b = part.back(centroids[["Xf", "Yf"]].to_numpy(float))
    moved = centroids.assign(Xf=b[:, 0], Yf=b[:, 1])
    scales = dict(zip(("sd_x", "sd_y"), part.scale, strict=True))
    return moved.assign(**{name: moved[name] / by for name, by in scales.items() if name in moved})


def record_of(shown: Mapping[str, Window]) -> dict[str, Any]:
    """The windows as they are written to JSON: left, top, width, height (px of the calibration), columns, rows."""
    return {camera: part._asdict() for camera, part in shown.items()}
