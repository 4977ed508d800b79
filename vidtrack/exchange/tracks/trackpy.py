"""trackpy: a CSV of its table of features, a row a feature: y, x, frame, and particle once it was linked.

Upper-left origin, the centre of the first pixel is (0, 0) (indices of the array); frames from 0; px. Particles are
numbered camera by camera, so a number means nothing in another one. A particle that was not found in a frame has no
row. Rows without `particle` are detections and no tracks: they are refused. Source: trackpy.readthedocs.io (locate,
link).
"""

from __future__ import annotations

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path
from vidtrack.exchange.tracks.digitised import Digitised, of_rows
from vidtrack.exchange.tracks.table import Table, numbers_of


def is_header(header: list[str]) -> bool:
    """Whether the columns are those of trackpy."""
    return {"x", "y", "frame"} <= {cell.lower() for cell in header} and "particle" in {c.lower() for c in header}


def read(path: Path, table: Table) -> Digitised:
    """The particles of one camera."""
    at = {cell.lower(): k for k, cell in enumerate(table.header)}
    values = numbers_of(path, table, [at[name] for name in ("frame", "particle", "x", "y")])
    known = np.isfinite(values[:, :2]).all(-1)
    if not known.any():
        raise VidtrackError(f"{path}: no row has a frame and a particle. Link the features before they are saved.")
    values = values[known]
    names, frame, b, twice = of_rows(path, values[:, 0], [f"{n:g}" for n in values[:, 1]], values[:, 2:])
    if twice:
        raise VidtrackError(f"{path}: {twice} rows repeat a particle in one frame. Link the features again.")
    return Digitised("trackpy", tuple(f"p{name}" for name in names), frame, b, False, "upper-left", (0.0, 0.0))
