"""The noise of calibration balls' centroids, from what their clips show."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array

SMALLEST_SD_PX = 0.02
"""ASSUME: pixel locking and uneven light keep a centroid's error above this, however little it scatters."""


class Columns(Protocol):
    """Columns by name, as a table has them."""

    def __contains__(self, name: str, /) -> bool: ...
    def __getitem__(self, name: str, /) -> Any: ...


def centroid_sd(table: Columns, rows: NDArray[np.intp]) -> Array | None:
    """Noise of each position, px (n, 2), of rows (n,) of a table with sd_x, sd_y (px) and where known frames.

    Each is its own estimate, drawn towards all points' the fewer frames it rests on. None where nothing is known.
    """
    if "sd_x" not in table or "sd_y" not in table:
        return None
    own = np.stack([np.asarray(table[name], float)[rows] for name in ("sd_x", "sd_y")], -1)
    known = np.isfinite(own)
    if not known.any():
        return None
    frames = (
        np.nan_to_num(np.asarray(table["frames"], float)[rows, None]) if "frames" in table else np.ones((len(rows), 1))
    )
    common = float(np.median(own[known])) ** 2
    trust = np.where(known, frames / (frames + 10), 0.0)
    if "pixels" in table:  # a point that was placed by hand: its sd is a person's word, and no estimate
        trust = np.where(known & (table["pixels"].to_numpy(float)[rows, None] == 0), 1.0, trust)
    variance: Array = trust * np.where(known, own, 0) ** 2 + (1 - trust) * common + SMALLEST_SD_PX**2
    return np.sqrt(variance)
