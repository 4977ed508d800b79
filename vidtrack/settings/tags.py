"""`tags`: coded tags on a model, which name themselves."""

from __future__ import annotations

import re
from math import hypot
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from vidtrack.settings.sections import Positive, Section, Vector

SQUARE = 0.02
"""Share of a side by which four surveyed corners may differ from a square."""

Id = Annotated[int, Field(ge=0, le=2319)]


class Tags(Section):
    """Coded tags that a run's cameras see: they name themselves, and one camera gives their six degrees of freedom."""

    family: Literal["36h11", "36h10", "25h9", "16h5"] = Field(
        "36h11",
        description="of AprilTag; 36h11: the usual one, 587 tags; 36h10, 25h9, 16h5: other ones, whose fewer bits make "
        "false tags likelier",
    )
    size: Positive = Field(
        description="`units`, side of the black square, from edge to edge: measure it on the print",
    )
    ids: tuple[Id, ...] | None = Field(
        None, description="numbers of the tags that count; default: those of the bodies, else every one that is seen"
    )
    sigma: Annotated[float, Field(ge=0)] = Field(
        0.0,
        description="`units`, one standard deviation of `size`: a tag that is taken for 1 % too large seems 1 % too "
        "far",
    )


class TagPlace(Section):
    """Where a tag sits on a body, in the body's axes, world units: by its corners, or by its centre and directions."""

    corners: tuple[Vector, Vector, Vector, Vector] | None = Field(
        None,
        description="upper left, upper right, lower right, lower left corner of the black square, as the tag is read",
    )
    centre: Vector | None = Field(None, description="of the tag; default: the body's origin")
    normal: Vector = Field((0.0, 0.0, 1.0), description="direction out of the tag's face, of any length")
    up: Vector = Field((0.0, 1.0, 0.0), description="direction from the tag's lower to its upper edge, of any length")
    size: Positive | None = Field(None, description="`units`, of this tag's side; default: that of the run's tags")

    @model_validator(mode="after")
    def _is_a_square(self) -> TagPlace:
        if self.corners is not None:
            if self.centre is not None or self.size is not None:
                raise ValueError("corners say where the tag is: leave out centre and size")
            a, b, c, d = self.corners
            across, down = _minus(b, a), _minus(d, a)
            side = hypot(*across)
            skew = abs(_dot(across, down)) / max(side, 1e-300)
            closed = hypot(*_minus(_minus(c, b), down))
            if not side > 0 or max(skew, closed, abs(hypot(*down) - side)) > SQUARE * side:
                raise ValueError("the four corners are no square: give them round from the upper left one")
        elif hypot(*_cross(self.normal, self.up)) <= 1e-6 * hypot(*self.normal) * hypot(*self.up):
            raise ValueError("normal and up are parallel: up goes along the tag, normal out of it")
        return self

    def places(self, size: float) -> list[list[float]]:
        """The corners (4, 3), world units, of a tag whose side is `size` where the place says none."""
        if self.corners is not None:
            return [list(corner) for corner in self.corners]
        out = _unit(self.normal)
        along = _dot(self.up, out)
        up = _unit((self.up[0] - along * out[0], self.up[1] - along * out[1], self.up[2] - along * out[2]))
        right, half = _cross(up, out), (self.size or size) / 2
        centre = self.centre or (0.0, 0.0, 0.0)
        around = ((-1, 1), (1, 1), (1, -1), (-1, -1))
        return [[centre[k] + half * (x * right[k] + y * up[k]) for k in range(3)] for x, y in around]


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a: Vector) -> Vector:
    length = hypot(*a)
    return (a[0] / length, a[1] / length, a[2] / length)


def placed(value: Any) -> Any:
    """A centre alone, or four corners alone, stand for a whole place; tag7 for 7."""
    if not isinstance(value, dict):
        return value
    return {_number(tag): _place(own) for tag, own in value.items()}


def _number(tag: Any) -> Any:
    return int(tag[3:]) if isinstance(tag, str) and re.fullmatch(r"tag\d+", tag) else tag


def _place(own: Any) -> Any:
    if isinstance(own, (list, tuple)):
        return {"corners" if len(own) == 4 else "centre": own}
    return {} if own is None else own


TagPlaces = Annotated[dict[Id, TagPlace], BeforeValidator(placed)]
