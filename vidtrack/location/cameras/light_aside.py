"""What light from one side leaves in the centroids of a run, and what one camera shows of the others.

A lamp lights the targets for all cameras. Where it stands behind them, one of the cameras sees a thin rim of its light,
which moves centroids by less than noise hides, and by more than their sd: what another camera shows plainly may be here
too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array


def light_aside(readings: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Camera: what its centroids' sd does not hold yet of the light of its targets, px of one coordinate; none where no
    camera sees them lit from one side.

    readings  camera: the record of its centroids
    """
    if not any("lighting" in own for own in readings.values()):
        return {}
    found = {}
    for name, own in readings.items():
        if "lighting" in own:
            found[name] = 0.0
        elif (aside := own.get("light_aside_px")) is not None:
            found[name] = float(aside) / 2**0.5
    return found


def with_light_aside(sd: Array, aside: Sequence[float | None]) -> Array:
    """sd (n_cameras, m, M, 2) px with what it does not hold yet; None: of a camera whose targets are not lit so."""
    more = np.array([own or 0.0 for own in aside])
    return np.hypot(sd, more[:, None, None, None]) if more.any() else sd
