"""Which kind of file points over time are in."""

from __future__ import annotations

import os

from vidtrack.errors import VidtrackError
from vidtrack.exchange.points import c3d, qtm, qtm_mat
from vidtrack.exchange.points.measured import Measured
from vidtrack.exchange.text import Path

READERS = {".c3d": c3d.read, ".tsv": qtm.read, ".mat": qtm_mat.read}


def read_measured(path: Path) -> Measured:
    """The points of a file, by its ending; VidtrackError, one line, for what cannot be read."""
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in READERS:
        raise VidtrackError(f"{path}: points are read from {', '.join(READERS)} and CSV. Export one of them.")
    return READERS[ending](path)
