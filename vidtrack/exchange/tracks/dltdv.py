"""DLTdv and Argus: points of several cameras in one table (xypts), a row a frame of the first camera.

DLTdv 8, 2023 on     `<name>_cam1_U, <name>_cam1_V, ...`: upper-left origin, MATLAB's pixels, the first centre is (1, 1)
DLTdv 5 to 8         `pt1_cam1_X, pt1_cam1_Y, ...`: 5 to 7 turn the picture over (lower-left origin, first centre (1,
                     1)), early versions of 8 do not, and nothing in the file says which: it is asked for
Argus                `<name>_cam_1_x, <name>_cam_1_y`: lower-left origin, y = height - row, x = column from 0

Missing is NaN or an empty cell; Argus also writes 0, 0. DLTdv's sparse .tsv: dltdv_sparse. The rows of all cameras
belong to one moment: offsets between recordings have been used already. Units px. Sources: DLTdv7.m (flipud),
DLTdv8a.mlapp 8.4.1; argus_gui DLCclicker.py and output.py.
"""

from __future__ import annotations

import re

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, some
from vidtrack.exchange.tracks.digitised import Convention, Digitised, Origin
from vidtrack.exchange.tracks.table import Table, numbers_of

_COLUMN = re.compile(r"(.*?)_cam(_?)(\d+)_([XYUVxyuv])$")


def is_header(header: list[str]) -> bool:
    """Whether the columns are those of an xypts table."""
    named = [bool(_COLUMN.match(cell)) for cell in header if cell]
    return len(named) >= 2 and sum(named) >= 0.5 * len(named)


def cameras_of(header: list[str]) -> list[str]:
    """The numbers of the cameras of which the table has columns."""
    return sorted({found[3] for cell in header if (found := _COLUMN.match(cell))}, key=int)


def read(path: Path, table: Table, said: Convention, where: str) -> Digitised:
    """The tracks of one of the file's cameras."""
    places: dict[tuple[str, str], dict[str, int]] = {}
    argus = upper = False
    for k, cell in enumerate(table.header):
        if found := _COLUMN.match(cell):
            axis = {"u": "x", "v": "y"}.get(found[4].lower(), found[4].lower())
            places.setdefault((found[1], found[3]), {})[axis] = k
            argus, upper = argus or bool(found[2]), upper or found[4] in "UV"
    camera = _chosen(cameras_of(table.header), said, path, where)
    mine = {name: at for (name, number), at in places.items() if number == camera}
    if odd := [name for name, at in mine.items() if len(at) < 2]:
        raise VidtrackError(f"{path}: {odd[0]}_cam{camera} has one of its two columns only. Export it again.")
    columns = [at[axis] for at in mine.values() for axis in "xy"]
    b = numbers_of(path, table, columns).reshape(-1, len(mine), 2)
    notes: tuple[str, ...] = ()
    if argus:
        zero = (b == 0).all(-1)
        b[zero] = np.nan
        notes = (f"{zero.sum()} places at 0, 0 count as missing",) if zero.any() else ()
    kind = "argus" if argus else "dltdv8" if upper else "dltdv"
    convention: dict[str, tuple[Origin | None, tuple[float, float]]] = {
        "argus": ("lower-left", (0.0, 1.0)),
        "dltdv8": ("upper-left", (1.0, 1.0)),
        "dltdv": (None, (1.0, 1.0)),
    }
    origin, first = convention[said.format if said.format in convention else kind]
    return Digitised(
        kind,
        tuple(mine),
        np.arange(len(b), dtype=np.int64),
        b,
        True,
        origin,
        first,
        together=True,
        notes=notes,
    )


def _chosen(cameras: list[str], said: Convention, path: Path, where: str) -> str:
    wanted = re.sub(r"^cam_?", "", said.camera) if said.camera else None
    if wanted in cameras:
        return wanted
    if wanted is None and len(cameras) == 1:
        return cameras[0]
    shown = some([f"cam{number}" for number in cameras])
    raise VidtrackError(
        f"config.yaml: {where}.camera: {path} has points of {shown}. Say which of them each camera is, as in "
        "cameras.<camera>.tracks: {camera: cam1}."
    )
