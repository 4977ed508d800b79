"""Windows, tank walls and water surfaces of a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydantic import Field

from vidtrack.geometry.interface import Interface
from vidtrack.simulate.plan import Plan, Positive, Vector


class InterfacePlan(Plan):
    """A plane, or parallel planes with layers between, through which cameras see."""

    point: Vector = Field(description="world, on the plane that is nearest to the camera")
    normal: Vector = Field(description="of any length, either way")
    indices: tuple[Positive, ...] = Field(description="refractive indices from the camera on")
    thickness: Positive | tuple[Positive, ...] = Field((), description="world units, of each layer")


def interfaces_of(plans: Mapping[str, InterfacePlan], names: Sequence[str]) -> tuple[Interface, ...]:
    """The interfaces of these names. Raises ValueError for one that cannot be."""
    found = []
    for name in names:
        plan = plans[name]
        layers = plan.thickness if isinstance(plan.thickness, tuple) else (plan.thickness,)
        found.append(Interface(name, np.array(plan.point), np.array(plan.normal), plan.indices, layers))
    return tuple(found)
