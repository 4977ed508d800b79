"""Six degrees of freedom against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.figures.drawing import Drawing, new_drawing
from vidtrack.figures.style import PALETTE

if TYPE_CHECKING:
    from pandas import DataFrame


def six_degrees(bodies: DataFrame, units: str, title: str) -> Drawing:
    """x, y, z on the left, roll, pitch, yaw on the right, two standard deviations shaded; a colour a body."""
    return against_time(bodies, "body", ("x", "y", "z", "roll", "pitch", "yaw"), units, title)


def against_time(table: DataFrame, by: str, names: tuple[str, ...], units: str, title: str) -> Drawing:
    """Six columns against time with two standard deviations (sigma_<name>): three lengths left, three angles right.

    by   the column whose values have a colour each
    """
    drawing = new_drawing(3, 2, height=1.6, shared=True, title=title)
    for i, (label, rows) in enumerate(table.groupby(by, sort=False)):
        colour = PALETTE[i % len(PALETTE)]
        for k, name in enumerate(names):
            ax = drawing.grid[k % 3][k // 3]
            ax.around(rows["time_s"], rows[name], 2 * rows[f"sigma_{name}"], colour)
            ax.plot(rows["time_s"], rows[name], colour, width=1.0, label=str(label))
            ax.ylabel = f"{name} ({units if k < 3 else 'deg'})"
    for ax in drawing.grid[-1]:
        ax.clock()
        for row in drawing.grid:
            for own in row:
                own.x_first = ax.x_first
    drawing.axes[0].legend = True
    return drawing
