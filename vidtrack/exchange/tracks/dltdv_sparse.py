"""DLTdv 6 to 8, the sparse form of xypts (.tsv), which DLTdv proposes first: only what was digitised stands in it.

A line of text ("Sparse format camera coordinates file"), a line of `rows columns values`, then a line a value, `row
column value`, from 1 and separated by tabs. Columns are point 1 in all cameras (x, y of camera 1, of camera 2, ...),
then point 2; how many cameras there are the file does not say. Values are px as in the flat table of the same version
of DLTdv; what is not there was not digitised. Source: sparseSave of DLTdv7.m.
"""

from __future__ import annotations

import re

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path
from vidtrack.exchange.tracks.digitised import Convention, Digitised

MOST = 50_000_000
"""Places of points times frames: more are not made of a small file."""


def is_sparse(text: str) -> bool:
    """Whether a text is one of DLTdv's sparse files."""
    return text[:40].lower().lstrip("\ufeff ").startswith("sparse format")


def read(path: Path, text: str, said: Convention, where: str) -> Digitised:
    """The tracks of one of the file's cameras, which the config names as "1 of 3"."""
    title, _, rest = text.partition("\n")
    if "camera coordinates" not in title.lower():
        raise VidtrackError(f"{path}: {title.strip()[:60]}: no places in pictures. Take DLTdv's xypts.tsv.")
    counts, values = _numbers(path, rest)
    rows, columns = int(counts[0]), int(counts[1])
    camera, cameras = _chosen(said, path, where)
    if columns % (2 * cameras):
        raise VidtrackError(
            f"config.yaml: {where}.camera: {path} has {columns} columns, which are not two a point in {cameras} "
            "cameras. Correct how many cameras there are."
        )
    at = values[:, :2].astype(np.int64) - 1
    if len(values) != int(counts[2]) or (at < 0).any() or (at >= [rows, columns]).any():
        raise VidtrackError(f"{path}: its values are not those that line 2 counts. Copy the whole file again.")
    point, inside = np.divmod(at[:, 1], 2 * cameras)
    own = inside // 2 == camera - 1
    if not own.any():
        raise VidtrackError(f"{path}: nothing was digitised in camera {camera} of {cameras}. Correct camera.")
    frame, i = np.unique(at[own, 0], return_inverse=True)
    points, k = np.unique(point[own], return_inverse=True)
    if len(frame) * len(points) > MOST:
        raise VidtrackError(f"{path}: {len(points)} points in {len(frame)} frames are too many. Save it in parts.")
    b = np.full((len(frame), len(points), 2), np.nan)
    b[i, k, inside[own] % 2] = values[own, 2]
    b[~np.isfinite(b).all(-1)] = np.nan
    upper = said.format == "dltdv8"
    names = tuple(f"pt{n + 1}" for n in points)
    return Digitised(
        "dltdv8" if upper else "dltdv",
        names,
        frame,
        b,
        True,
        "upper-left" if upper else None,
        (1.0, 1.0),
        together=True,
    )


def _numbers(path: Path, rest: str) -> tuple[np.ndarray, np.ndarray]:
    """The counts of line 2 (3,), and the values (n, 3) below it."""
    try:
        table = np.array([line.split("\t") for line in rest.splitlines() if line.strip()], float)
    except ValueError:
        table = np.empty((0, 0))
    if table.ndim != 2 or table.shape[0] < 2 or table.shape[1] != 3 or not np.isfinite(table).all():
        raise VidtrackError(f"{path}: a sparse file of DLTdv has three numbers a line. Copy the whole file again.")
    if (table[0] < 0).any() or (table[:, :2] != np.floor(table[:, :2])).any() or table[:, :2].max() > 1e9:
        raise VidtrackError(f"{path}: rows and columns of a sparse file are whole numbers. Copy the whole file again.")
    return table[0], table[1:]


def _chosen(said: Convention, path: Path, where: str) -> tuple[int, int]:
    found = re.fullmatch(r"\s*(?:cam)?_?(\d{1,4})\s+of\s+(\d{1,4})\s*", said.camera or "")
    if found and 1 <= int(found[1]) <= int(found[2]):
        return int(found[1]), int(found[2])
    raise VidtrackError(
        f"config.yaml: {where}.camera: a sparse file of DLTdv ({path}) does not say how many cameras it has. Give "
        "which one of how many, as in camera: 1 of 3."
    )
