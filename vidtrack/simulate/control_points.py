"""Calibration balls of a scenario or a plan: on wires, or each by its name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from vidtrack.arrays import Array
from vidtrack.simulate.plan import Plan, Vector
from vidtrack.simulate.rig import points_on_wires

MOST_BALLS = 100_000
WIRES, NAMED = "(wires)", "(named)"  # in parentheses: a form, no key of the file
Count = Annotated[int, Field(ge=1, le=MOST_BALLS)]


class Wires(Plan):
    """Calibration balls on plumb wires, tagged 1, 2, ... row by row, wire by wire, from the top down."""

    rows: Count = 4
    wires: Count = 4
    balls: Count = 4
    spacing: Vector = Field(description="world units along x (wires), y (rows) and z (balls)")
    centre: Vector = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        if self.rows * self.wires * self.balls > MOST_BALLS:
            raise ValueError(f"rows, wires and balls make more than {MOST_BALLS:,} balls. Give smaller numbers")
        return self


def _form(points: Any) -> str:
    """Which of the two a user writes: of names each has three numbers, of wires few things have."""
    if isinstance(points, Mapping):
        named = "spacing" not in points and all(isinstance(place, (list, tuple)) for place in points.values())
        return NAMED if named else WIRES
    return WIRES


ControlPoints = Annotated[Annotated[Wires, Tag(WIRES)] | Annotated[dict[str, Vector], Tag(NAMED)], Discriminator(_form)]


def tags_and_places(points: Wires | Mapping[str, Vector]) -> tuple[list[str], Array]:
    """Tags, and places (n, 3) in world units."""
    if isinstance(points, Wires):
        return points_on_wires(**points.model_dump())
    return list(points), np.array(list(points.values()), float).reshape(-1, 3)
