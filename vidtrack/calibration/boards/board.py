"""A flat board of known corners: where they are, and how the board itself may differ from its drawing.

    x along the columns, y up the rows, z out of the face; the origin is the lower left corner of the pattern

A printed board is not quite flat and its two sides are not quite scaled alike: bending is a quadratic in x and y,
stretch scales y alone. Its scale as a whole no picture shows: it is that of `square`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from vidtrack.arrays import Array

BoardType = Literal["charuco", "checkerboard", "circles", "apriltag"]
SHAPE = ("bend_xx", "bend_xy", "bend_yy", "stretch")
BENDING = 0.002
"""ASSUME: standard deviation of the sag at the board's rim, as a share of its half diagonal: 0.4 mm of an A3 sheet."""
STRETCH = 0.0005
"""ASSUME: standard deviation of what a printer scales one side more than the other."""


@dataclass(frozen=True)
class Board:
    """A board as it was drawn.

    columns, rows  squares of a charuco board or checkerboard, circles, or tags
    square         world units, side of a square; from centre to centre of circles and tags
    marker         world units, side of a tag, or diameter of a circle; default: three quarters, or half, of a square
    dictionary     of the tags, as OpenCV names it
    """

    type: BoardType
    columns: int
    rows: int
    square: float
    marker: float = 0.0
    dictionary: str = ""

    @property
    def tag_side(self) -> float:
        """World units."""
        return self.marker or 0.75 * self.square

    @property
    def diameter(self) -> float:
        """World units, of a circle."""
        return self.marker or 0.5 * self.square

    @property
    def tags(self) -> str:
        """The dictionary of its tags."""
        return self.dictionary or ("DICT_APRILTAG_36h11" if self.type == "apriltag" else "DICT_5X5_250")

    @cached_property
    def corners(self) -> Array:
        """(q, 3) world units, on the board's plane, of every corner, circle or corner of a tag, in the order of ids."""
        if self.type == "apriltag":
            gap = (self.square - self.tag_side) / 2
            x, y = np.meshgrid(np.arange(self.columns) * self.square, np.arange(self.rows) * self.square)
            left_top = np.stack([x.ravel() + gap, y.ravel() + gap], -1)
            around = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * self.tag_side
            flat = (left_top[:, None] + around).reshape(-1, 2)
        else:
            n, m = (self.columns, self.rows) if self.type == "circles" else (self.columns - 1, self.rows - 1)
            first = self.square / 2 if self.type == "circles" else self.square
            x, y = np.meshgrid(first + np.arange(n) * self.square, first + np.arange(m) * self.square)
            flat = np.stack([x.ravel(), y.ravel()], -1)
        return np.stack([flat[:, 0], self.rows * self.square - flat[:, 1], np.zeros(len(flat))], -1)

    @property
    def half_diagonal(self) -> float:
        """World units."""
        return 0.5 * self.square * float(np.hypot(self.columns, self.rows))

    @property
    def shape_priors(self) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of the board's own shape."""
        sag = BENDING * self.half_diagonal
        return {"bend_xx": (0.0, sag), "bend_xy": (0.0, sag), "bend_yy": (0.0, sag), "stretch": (0.0, STRETCH)}

    def shaped(self, shape: dict[str, float]) -> tuple[Array, dict[str, Array]]:
        """The corners (q, 3) of the board as it is, and their derivatives (q, 3) by each number of SHAPE."""
        p = self.corners
        centre = np.array([self.columns, self.rows]) * self.square / 2
        u, v = ((p[:, :2] - centre) / self.half_diagonal).T
        zero = np.zeros(len(p))
        by = {
            "bend_xx": np.stack([zero, zero, u * u], -1),
            "bend_xy": np.stack([zero, zero, u * v], -1),
            "bend_yy": np.stack([zero, zero, v * v], -1),
            "stretch": np.stack([zero, p[:, 1] - centre[1], zero], -1),
        }
        moved = p + sum(float(shape.get(name, 0.0)) * by[name] for name in SHAPE)
        return np.asarray(moved), by
