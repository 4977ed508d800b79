"""The pieces of pictures that the track stage kept of a camera, read from their table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints

Columns = Mapping[str, NDArray[Any]]


class Kept(NamedTuple):
    """Pieces (N,) of one camera's pictures, as the track stage keeps them."""

    time: Array  # (N,) s, by the camera's own clock
    left: Ints  # (N,) px, first column and row of the sample
    top: Ints
    parity: Ints
    lines: Ints
    grey: list[NDArray[np.uint8]]  # (rows, columns) grey levels from 1; 0: of no use
    noise: float  # grey levels, of a pixel
    grown: Array  # (2,) by which the sd of fits are to be grown
    exposure: float  # samples; 0: too short to be seen
    lit: Array  # (3, N) way from a target's light to the middle of its outline, x and y, of its radius, and its sd


def kept_of(columns: Columns) -> Kept:
    """The pieces of a table `tracking.windows.COLUMNS`."""
    widths = columns["width"].tolist()
    grey = [
        np.frombuffer(own, np.uint8).reshape(-1, w) for own, w in zip(columns["grey"].tolist(), widths, strict=True)
    ]
    left, top, parity, lines = (np.asarray(columns[name], np.intp) for name in ("left", "top", "parity", "lines"))
    whole = [float(columns[name][0]) if len(grey) else 1.0 for name in ("noise", "grown_x", "grown_y", "exposure")]
    time = np.asarray(columns["time_s"], float)
    lit = np.array([columns[name] for name in ("lit_x", "lit_y", "lit_sd")], float)
    return Kept(time, left, top, parity, lines, grey, whole[0], np.array(whole[1:3]), whole[3], lit)
