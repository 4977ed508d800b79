"""camera.json: a calibrated camera in Tsai's symbols, how well each is known, and how it came about."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, cast, get_args

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json, write_json
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.jacobian import position_covariance
from vidtrack.geometry.lens_terms import COEFFICIENTS, LENS_MODELS
from vidtrack.geometry.projection import Projection

SCALARS = ("Cx", "Cy", "dx", "dy", "Sx", "f", "kappa1")
RICHER = tuple(name for name in COEFFICIENTS if name not in SCALARS)
"""Written where the camera has them; absent is 0."""


class Calibrated(NamedTuple):
    """A camera.json as read."""

    camera: Camera
    uncertainty: Uncertainty | None
    record: dict[str, Any]  # every key of the file

    @property
    def describes(self) -> str:
        """Where the camera shows a ball: `points` the image of its middle, `outlines` the middle of its outline, as
        cameras do that an older version fitted to balls (see `geometry.ball_perspective`).
        """
        old = "outlines" if self.record.get("n_points") else "points"
        return str(self.record.get("describes", old))


def write_camera(
    path: str | os.PathLike[str],
    camera: Camera,
    uncertainty: Uncertainty | None,
    extra: Mapping[str, Any],
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write camera.json, whole or not at all.

    extra   what else is known of the calibration: model, units, n_points, rms_px, settings, warnings...
            It cannot overwrite the camera's own keys.
    """
    write_json(path, camera_record(camera, uncertainty, extra), provenance or {})


def camera_record(camera: Camera, uncertainty: Uncertainty | None, extra: Mapping[str, Any]) -> dict[str, Any]:
    """What camera.json holds, as plain values, but for the provenance."""
    own: dict[str, Any] = {"camera": camera.name, "image_size": list(camera.image_size)}
    own |= {name: float(getattr(camera, name)) for name in SCALARS}
    terms = LENS_MODELS.get(str(extra.get("model", "tsai")), ())
    own |= {name: float(getattr(camera, name)) for name in RICHER if getattr(camera, name) or name in terms}
    if camera.projection != "perspective":
        own["projection"] = camera.projection
    own |= {"R": camera.R.tolist(), "T": camera.T.tolist(), "det_R": float(np.linalg.det(camera.R))}
    own["position"] = camera.position.tolist()
    own["describes"] = str(extra.get("describes", "points"))
    if camera.through:
        own["through"] = [_interface_record(interface) for interface in camera.through]
    if uncertainty is not None:
        own |= _uncertainty_record(uncertainty)
        known = uncertainty.names, uncertainty.pivot, uncertainty.covariance
        own["position_sd"] = np.sqrt(np.diagonal(position_covariance(camera, *known))).tolist()
    return {**own, **{key: value for key, value in extra.items() if key not in own}}


def _uncertainty_record(uncertainty: Uncertainty) -> dict[str, Any]:
    names = uncertainty.names
    correlations = np.round(uncertainty.correlations, 6).tolist()
    return {
        "standard_errors": dict(zip(names, uncertainty.standard_errors.tolist(), strict=True)),
        "correlations": {
            row: dict(zip(names, values, strict=True)) for row, values in zip(names, correlations, strict=True)
        },
        "uncertainty": {
            "names": list(names),
            "pivot": np.asarray(uncertainty.pivot).tolist(),
            "covariance": np.asarray(uncertainty.covariance).tolist(),
        },
    }


def read_camera(path: str | os.PathLike[str]) -> Calibrated:
    """The camera at `path` and all that was written with it; VidtrackError where it holds no camera."""
    record = read_json(path)
    try:
        scalars: dict[str, Any] = {name: float(record[name]) for name in SCALARS}
        scalars |= {name: float(record.get(name, 0.0)) for name in RICHER}
        camera = Camera(
            **scalars,
            R=_array(record, "R", (3, 3)),
            T=_array(record, "T", (3,)),
            image_size=(int(record["image_size"][0]), int(record["image_size"][1])),
            projection=_projection(record),
            name=str(record.get("camera", "")),
            through=tuple(interface_from_record(own) for own in record.get("through", ())),
        )
        uncertainty = _uncertainty(record.get("uncertainty"))
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise VidtrackError(
            f"{path}: holds no camera ({str(error)[:120]}). Delete the file and run again, or correct the value."
        ) from None
    return Calibrated(camera, uncertainty, record)


def located_by(folder: str, refined: bool) -> str:
    """The file of a camera's folder that runs are located by: refined.json where a body refines the cameras."""
    own = os.path.join(folder, "refined.json")
    return own if refined and os.path.isfile(own) else os.path.join(folder, "camera.json")


def _interface_record(interface: Interface) -> dict[str, Any]:
    return {
        "name": interface.name,
        "point": interface.point.tolist(),
        "normal": interface.normal.tolist(),
        "thickness": list(interface.thickness),
        "indices": list(interface.indices),
        "sigma": dict(zip(interface.parameters, interface.sigma, strict=False)),
    } | ({"known": _interface_record(interface.known)} if interface.known else {})


def interface_from_record(record: Mapping[str, Any]) -> Interface:
    """An interface as camera.json holds it under `through`."""
    indices, thickness = (tuple(float(v) for v in record[key]) for key in ("indices", "thickness"))
    point, normal = _array(record, "point", (3,)), _array(record, "normal", (3,))
    known = interface_from_record(record["known"]) if record.get("known") else None
    own = Interface(str(record["name"]), point, normal, indices, thickness, known=known)
    sigma = record.get("sigma")
    return replace(own, sigma=tuple(float(sigma[name]) for name in own.parameters)) if sigma else own


def _array(record: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> Array:
    values = np.array(record[name], float)
    if values.shape != shape or not np.isfinite(values).all():
        raise ValueError(f"{name} must have {' x '.join(map(str, shape))} numbers")
    return values


def _uncertainty(record: Mapping[str, Any] | None) -> Uncertainty | None:
    if not record:
        return None
    names, pivot = tuple(record["names"]), np.array(record["pivot"], float)
    covariance = np.array(record["covariance"], float)  # null, where a covariance is not known, becomes NaN
    if covariance.shape != (len(names), len(names)) or pivot.shape != (3,):
        raise ValueError(f"the covariance of {len(names)} parameters has shape {covariance.shape}")
    return Uncertainty(names, pivot, covariance)


def _projection(record: Mapping[str, Any]) -> Projection:
    value = record.get("projection", "perspective")
    if value not in get_args(Projection):
        raise ValueError(f"projection {value!r} is not {' or '.join(get_args(Projection))}")
    return cast(Projection, value)
