"""Motions of a body at a named point: six degrees of freedom against time, and its excursions from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.bodies import against_time
from vidtrack.figures.style import PALETTE, REFERENCE_COLOUR, legend, new_figure
from vidtrack.freedom import DEGREES_OF_FREEDOM

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from vidtrack.arrays import Array


def motions(table: DataFrame, units: str, title: str) -> Figure:
    """Surge, sway, heave on the left, roll, pitch, yaw on the right; two standard deviations shaded.

    table   rows of motions.parquet of one body; a colour a point
    """
    return against_time(table, "point", DEGREES_OF_FREEDOM, units, title)


def envelope(table: DataFrame, hull: Array, radius: float, units: str, title: str) -> Figure:
    """The horizontal excursions of a point at equal scales: its path, their envelope, and the watch circle.

    table   rows of motions.parquet of one body and point; hull (k, 2) surge and sway; radius of the circle
    """
    figure, ax = new_figure(width=4.6, height=4.4)
    ax.plot(table["surge"], table["sway"], color=PALETTE[0], lw=0.7, label="path")
    if len(hull) > 2:
        around = np.concatenate([hull, hull[:1]])
        ax.plot(*around.T, color=PALETTE[1], lw=1.0, label="envelope")
    angle = np.linspace(0, 2 * np.pi, 181)
    label = f"watch circle, {radius:.3g} {units}"
    ax.plot(radius * np.cos(angle), radius * np.sin(angle), color=REFERENCE_COLOUR, lw=0.8, ls="--", label=label)
    ax.set_aspect("equal")
    ax.set_xlabel(f"surge ({units})", fontsize=8)
    ax.set_ylabel(f"sway ({units})", fontsize=8)
    legend(ax, fontsize=7, loc="upper right")
    figure.suptitle(title, fontsize=10)
    return figure
