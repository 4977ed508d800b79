"""Motions of a body at a named point: six degrees of freedom against time, and its excursions from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.bodies import against_time
from vidtrack.figures.drawing import INK, Drawing, new_drawing
from vidtrack.figures.style import PALETTE
from vidtrack.freedom import DEGREES_OF_FREEDOM

if TYPE_CHECKING:
    from pandas import DataFrame

    from vidtrack.arrays import Array


def motions(table: DataFrame, units: str, title: str) -> Drawing:
    """Surge, sway, heave on the left, roll, pitch, yaw on the right; two standard deviations shaded.

    table   rows of motions.parquet of one body; a colour a point
    """
    return against_time(table, "point", DEGREES_OF_FREEDOM, units, title)


def envelope(table: DataFrame, hull: Array, radius: float, units: str, title: str) -> Drawing:
    """The horizontal excursions of a point at equal scales: its path, their envelope, and the watch circle.

    table   rows of motions.parquet of one body and point; hull (k, 2) surge and sway; radius of the circle
    """
    drawing = new_drawing(width=4.6, height=4.6, title=title)
    (ax,) = drawing.axes
    ax.plot(table["surge"], table["sway"], PALETTE[0], width=1.0, label="path")
    if len(hull) > 2:
        around = np.concatenate([hull, hull[:1]])
        ax.plot(around[:, 0], around[:, 1], PALETTE[1], label="envelope")
    angle = np.linspace(0, 2 * np.pi, 181)
    label = f"watch circle, {radius:.3g} {units}"
    ax.plot(radius * np.cos(angle), radius * np.sin(angle), INK, width=1.0, dash="5 4", label=label)
    ax.equal, ax.legend = "limits", True
    ax.xlabel, ax.ylabel = f"surge ({units})", f"sway ({units})"
    return drawing
