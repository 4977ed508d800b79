"""Interfaces as the config has them, and what calibration points say of interfaces that were taken for known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.geometry.interface import Interface
from vidtrack.lengths import METRES

# ASSUME: where nothing is said, a plane is measured to 5 mm and levelled to half a degree; handbooks know indices
# better than the points do, to 0.001, and a pane's thickness is what its maker says.
POSITION_SD_M, TILT_SD_DEG, INDEX_SD, THICKNESS_SD = 0.005, 0.5, 0.001, 0.0


def interfaces_from_settings(where: str, through: Sequence[Mapping[str, Any]], units: str) -> tuple[Interface, ...]:
    """The interfaces that the settings describe, from the camera on; lengths in `units`.

    VidtrackError where one cannot be, or where light would leave one in another medium than that in which it enters
    the next.
    """
    found = []
    for own in through:
        sigma = dict(own.get("sigma") or {})
        try:
            interface = Interface(
                str(own["name"]),
                np.array(own["point"], float),
                np.array(own["normal"], float),
                tuple(own["indices"]),
                _layers(own.get("thickness")),
            )
        except ValueError as error:
            raise VidtrackError(f"{where}: {error}. Correct it under interfaces in config.yaml.") from None
        found.append(with_sigma(interface, sigma, units))
    for first, second in pairwise(found):
        if abs(first.indices[-1] - second.indices[0]) > 0.01:
            raise VidtrackError(
                f"{where}: behind interface {first.name} the index is {first.indices[-1]:g}, before {second.name} "
                f"{second.indices[0]:g}. Give the same medium, or the order in which light passes them from the camera."
            )
    return tuple(found)


def _layers(thickness: Any) -> tuple[float, ...]:
    if thickness is None:
        return ()
    return tuple(thickness) if isinstance(thickness, (list, tuple)) else (float(thickness),)


def with_sigma(interface: Interface, sigma: Mapping[str, float], units: str) -> Interface:
    """The interface with what is known of it: sigma as in the config, defaults where it says nothing."""
    metre = 1 / METRES[units]
    given = {
        "position": sigma.get("position", POSITION_SD_M * metre),
        "tilt": np.radians(sigma.get("tilt", TILT_SD_DEG)),
        "thickness": sigma.get("thickness", THICKNESS_SD),
        "index": sigma.get("index", INDEX_SD),
    }
    each = []
    for name in interface.parameters:
        kind = name.removeprefix(f"{interface.name}.").split("_")[0]
        solid = kind == "index" and name != interface.parameters[-1]  # of a pane: its bending depends on it little
        each.append(0.0 if solid and "index" not in sigma else float(given[kind]))
    return Interface(
        interface.name, interface.point, interface.normal, interface.indices, interface.thickness, tuple(each)
    )
