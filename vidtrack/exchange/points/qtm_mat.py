"""QTM: the MAT files that Qualisys Track Manager exports, of labelled markers and of bodies (their origin's place).

One struct, named as the measurement: FrameRate, Frames, Timestamp; Trajectories.Labeled.Labels and Data (markers, 4,
frames: x, y, z, residual); RigidBodies.Name and Positions (bodies, 3, frames). mm, axes of QTM's calibration,
right-handed; NaN where a marker or a body was not seen. Bodies follow markers. Angles are not read (R = Rx Ry Rz, see
docs/formats.md). Files of version 7.3 are HDF5 and refused. Source: the QTM manual, export to MAT; readers in public
projects.
"""

from __future__ import annotations

import io
from typing import Any, cast

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.measured import Measured
from vidtrack.exchange.points.qtm import start_of
from vidtrack.exchange.text import Path, bytes_of


def read(path: Path) -> Measured:
    """The labelled markers and the bodies of a MAT file."""
    data = bytes_of(path)
    if data[:512].startswith(b"MATLAB 7.3") or data[:8] == b"\x89HDF\r\n\x1a\n":
        raise VidtrackError(f"{path}: a MAT file of version 7.3. Save it in MATLAB with -v7, or export TSV from QTM.")
    try:
        own = _measurement(data)
        if own is None:
            raise VidtrackError(f"{path}: no measurement of QTM in it (FrameRate beside Trajectories or RigidBodies).")
        rate = float(np.ravel(own["FrameRate"])[0])
        parts = [_markers(own), _bodies(own)]
    except (ValueError, TypeError, KeyError, IndexError, NotImplementedError, OSError, EOFError) as error:
        raise VidtrackError(f"{path}: not a whole MAT file of QTM ({str(error)[:80]}). Export it again.") from None
    if not rate > 0:
        raise VidtrackError(f"{path}: its FrameRate {rate:g} is not positive. Export it again.")
    found = [part for part in parts if part is not None]
    if not found:
        raise VidtrackError(
            f"{path}: no labelled marker and no body in it. Label trajectories in QTM, and export again."
        )
    names: list[str] = []
    for name in (name for part in found for name in part[0]):
        while name in names:
            name += "'"
        names.append(name)
    p = np.concatenate([part[1] for part in found], 1)
    stamp = [str(text) for text in np.ravel(own.get("Timestamp", ""))]
    return Measured("QTM", tuple(names), p, np.arange(len(p)) / rate, "mm", start_of(stamp))


Part = tuple[list[str], Array]
"""Names (n,), and places (frames, n, 3)."""


def _measurement(data: bytes) -> dict[str, Any] | None:
    """The fields of the struct that is a measurement; None where there is none."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(cast(Any, io.BytesIO(data)))
    except MatReadError as error:
        raise ValueError(str(error)) from None
    for name, value in content.items():
        own = _fields(value)
        if not name.startswith("__") and "FrameRate" in own and {"Trajectories", "RigidBodies"} & set(own):
            return own
    return None


def _fields(value: Any) -> dict[str, Any]:
    """The fields of a struct of one element; nothing where it is none."""
    if not isinstance(value, np.ndarray) or value.dtype.names is None or value.size != 1:
        return {}
    return {name: value.ravel()[0][name] for name in value.dtype.names}


def _markers(own: dict[str, Any]) -> Part | None:
    labelled = _fields(_fields(own.get("Trajectories")).get("Labeled"))
    return _part(labelled.get("Labels"), labelled.get("Data"), 4)


def _bodies(own: dict[str, Any]) -> Part | None:
    bodies = _fields(own.get("RigidBodies"))
    return _part(bodies.get("Name"), bodies.get("Positions"), 3)


def _part(labels: Any, places: Any, width: int) -> Part | None:
    if labels is None or places is None or not np.size(labels) or not np.size(places):
        return None
    names = [str(np.ravel(each)[0]) if np.size(each) else f"p{k + 1}" for k, each in enumerate(np.ravel(labels))]
    values = np.asarray(places, float)
    if values.ndim == 2:  # one frame
        values = values[..., None]
    if values.ndim != 3 or values.shape[:2] != (len(names), width):
        raise ValueError(f"{len(names)} names and places of shape {np.shape(places)}")
    p = np.moveaxis(values[:, :3], 2, 0)
    return names, np.asarray(np.where(np.isfinite(p).all(-1, keepdims=True), p, np.nan))
