"""A run whose tags one camera alone sees: their poses are its trajectories, and no lines of sight meet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vidtrack.location.cameras.run_sights import RunSights


def record_of(camera: str, clock: Mapping[str, Any], units: str, samples: int, located: int) -> dict[str, Any]:
    """The record of such a run, as that of runs with lines of sight.

    clock             what the config gives: offset_s, rate_ppm; 0 where it gives none
    samples, located  rows of the trajectories, and those with a position
    """
    return {
        "mode": "space",
        "units": units,
        "cameras": [camera],
        "clocks": {"cameras": {camera: {"offset_s": 0.0, "rate_ppm": 0.0, **clock, "source": "config"}}},
        "samples": {"total": samples, "located": located},
        "findings": [],
        "warnings": [],
    }


def no_sights(camera: str) -> RunSights:
    """The sights of such a run: none."""
    nothing = np.zeros((1, 0, 0, 2))
    return RunSights(np.zeros(0), (), (camera,), nothing, nothing, np.zeros((1, 0, 0), bool), {})
