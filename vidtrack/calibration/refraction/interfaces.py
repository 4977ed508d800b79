"""Interfaces as the config has them, and what calibration points say of interfaces that were taken for known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.geometry.interface import Interface
from vidtrack.lengths import METRES


@dataclass(frozen=True)
class InterfaceSettings:
    """What is assumed of an interface where the config says nothing of its errors; standard deviations."""

    position_sd_m: float = 0.005
    """m, along the normal: a plane is measured with a rule."""
    tilt_sd_deg: float = 0.5
    """Degrees about either axis: a plane is levelled with a spirit level."""
    index_sd: float = 0.001
    """Of refraction: handbooks know it better than the points do."""
    thickness_sd: float = 0.03
    """Share of a layer's thickness: ASSUME a pane of stock, whose maker gives 5 to 10 % as limits."""
    solid_index_sd: float = 0.005
    """Of a pane: ASSUME that its kind is known (acrylic, glass), not its make."""
    same_index: float = 0.01
    """Largest difference of the two indices that are given for one medium."""


SETTINGS = InterfaceSettings()


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
            raise VidtrackError(f"{where}: {error}. Correct the interface under interfaces in config.yaml.") from None
        found.append(with_sigma(interface, sigma, units))
    for first, second in pairwise(found):
        if abs(first.indices[-1] - second.indices[0]) > SETTINGS.same_index:
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
        "position": sigma.get("position", SETTINGS.position_sd_m * metre),
        "tilt": np.radians(sigma.get("tilt", SETTINGS.tilt_sd_deg)),
        "thickness": sigma.get("thickness", np.nan),
        "index": sigma.get("index", SETTINGS.index_sd),
    }
    each = []
    for name in interface.parameters:
        kind, _, number = name.removeprefix(f"{interface.name}.").partition("_")
        own = float(given[kind])
        if kind == "thickness" and "thickness" not in sigma:
            own = SETTINGS.thickness_sd * interface.thickness[int(number) - 1]
        if kind == "index" and name != interface.parameters[-1] and "index" not in sigma:
            own = SETTINGS.solid_index_sd
        each.append(own)
    return Interface(
        interface.name, interface.point, interface.normal, interface.indices, interface.thickness, tuple(each)
    )
