"""Positions in space, with time and uncertainty, from recorded video.

import vidtrack
lab = vidtrack.load("my-lab")
"""

from __future__ import annotations

TYPE_CHECKING = False  # importing typing would cost each job's start more than all else of it
if TYPE_CHECKING:
    import os

    from vidtrack.notebook.experiment import LoadedExperiment

__all__ = ["load"]


def load(folder: str | os.PathLike[str]) -> LoadedExperiment:
    """The results of an experiment: runs as tables and as xarray, cameras that project; see `vidtrack.notebook`."""
    from vidtrack.notebook.experiment import load as load_experiment

    return load_experiment(folder)
