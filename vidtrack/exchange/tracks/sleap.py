"""SLEAP: its analysis as HDF5 (`tracks`) or CSV (`track, frame_idx, instance.score, <node>.x, <node>.y, <node>.score`).

Upper-left origin, y down, px; frames from 0. Whether the centre of the first pixel is (0, 0) or (0.5, 0.5) depends
on the version and the tool that placed the points, and no file says it: `tracks.first_pixel` does. Missing is NaN or an
empty cell. A target is a node of an instance: `<track>_<node>`, or the node alone where there is one track. Tracks
that SLEAP named track_0 ... are numbered camera by camera and mean nothing in another one; nodes of a single animal do.
`tracks` is (tracks, 2, nodes, frames). Source: docs.sleap.ai (Export Data), sleap.io.convert.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path
from vidtrack.exchange.tracks.digitised import Digitised, of_rows
from vidtrack.exchange.tracks.table import Table, cells_of, numbers_of

_NUMBERED = re.compile(r"track_?\d+|")


def is_header(header: list[str]) -> bool:
    """Whether the columns are those of SLEAP's CSV."""
    return {"frame_idx", "track"} <= set(header) and any(cell.endswith(".x") for cell in header)


def read(path: Path, table: Table) -> Digitised:
    """The nodes in a CSV."""
    at = {cell: k for k, cell in enumerate(table.header)}
    nodes = [cell[:-2] for cell in table.header if cell.endswith(".x") and f"{cell[:-2]}.y" in at]
    columns = [at["frame_idx"], *(at[f"{node}.{axis}"] for node in nodes for axis in "xy")]
    values = numbers_of(path, table, columns)
    tracks = [cells_of(line, table.separator)[at["track"]] for line in table.text.split("\n") if line.strip()]
    several = len(set(tracks)) > 1
    names = [_name(track, node, several) for track in tracks for node in nodes]
    if not np.isfinite(values[:, 0]).all():
        raise VidtrackError(f"{path}: a row has no frame_idx. Export it again.")
    labels, frame, b, twice = of_rows(path, np.repeat(values[:, 0], len(nodes)), names, values[:, 1:].reshape(-1, 2))
    if twice:
        raise VidtrackError(
            f"{path}: {twice} points of one name in one frame: instances have no tracks. Track them in SLEAP."
        )
    named = not several or not any(_NUMBERED.fullmatch(track) for track in tracks)
    return Digitised("sleap", labels, frame, b, named, "upper-left", None)


def is_analysis(file: Any) -> bool:
    """Whether an open h5py.File is SLEAP's analysis."""
    return "tracks" in file and "node_names" in file


def read_h5(path: Path, file: Any) -> Digitised:
    """The nodes in an analysis file; file: an open h5py.File."""
    tracks = np.asarray(file["tracks"], float)
    nodes = [_text(name) for name in file["node_names"][:]]
    given = [_text(name) for name in file["track_names"][:]] if "track_names" in file else []
    if tracks.ndim != 4 or tracks.shape[1] != 2 or tracks.shape[2] != len(nodes):
        raise VidtrackError(
            f"{path}: tracks has shape {tracks.shape}, not (tracks, 2, nodes, frames). Export it again."
        )
    given = given if len(given) == len(tracks) else [f"track_{k}" for k in range(len(tracks))]
    several = len(tracks) > 1
    names = tuple(_name(track, node, several) for track in given for node in nodes)
    b = np.transpose(tracks, (3, 0, 2, 1)).reshape(tracks.shape[3], -1, 2)
    named = not several or not any(_NUMBERED.fullmatch(track) for track in given)
    return Digitised("sleap", names, np.arange(len(b), dtype=np.int64), b, named, "upper-left", None)


def _name(track: str, node: str, several: bool) -> str:
    return f"{track or 'untracked'}_{node}" if several else node


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
