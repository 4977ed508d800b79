"""The calibration of a run's cameras as the run's pictures have it, where those are of another size or part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.picture_part import Picture, Window, window


class Columns(Protocol):
    """A table: its columns by name."""

    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: str, /) -> bool: ...


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


def columns_shown(table: Columns, part: Window | None) -> dict[str, Array]:
    """Columns Xf, Yf and, where there are any, sd_x, sd_y (px) of the calibration, as the window's picture has them."""
    if part is None:
        return {}
    return _moved(table, part.seen(_positions(table)), part.scale)


def columns_in_calibration(table: Columns, part: Window | None) -> dict[str, Array]:
    """The same columns of what the run shows, in the calibration's picture."""
    if part is None:
        return {}
    return _moved(table, part.back(_positions(table)), 1 / part.scale)


def _positions(table: Columns) -> Array:
    return np.stack([np.asarray(table[name], float) for name in ("Xf", "Yf")], -1)


def _moved(table: Columns, b: Array, scale: Array) -> dict[str, Array]:
    sds = dict(zip(("sd_x", "sd_y"), scale, strict=True))
    out = {name: np.asarray(table[name], float) * by for name, by in sds.items() if name in table}
    return {"Xf": b[:, 0], "Yf": b[:, 1], **out}


def record_of(shown: Mapping[str, Window]) -> dict[str, Any]:
    """The windows as they are written to JSON: left, top, width, height (px of the calibration), columns, rows."""
    return {camera: part._asdict() for camera, part in shown.items()}
