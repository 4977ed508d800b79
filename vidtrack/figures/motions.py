"""Motions of a body at a named point: six degrees of freedom against time, and its excursions from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.style import PALETTE, REFERENCE_COLOUR, clock_axis, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from vidtrack.arrays import Array

DEGREES_OF_FREEDOM = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def motions(table: DataFrame, units: str, title: str) -> Figure:
    """Surge, sway, heave on the left, roll, pitch, yaw on the right; two standard deviations shaded.

    table   rows of motions.parquet of one body; a colour a point
    """
    figure, axes = new_figure(3, 2, height=1.6, sharex=True)
    for i, (point, rows) in enumerate(table.groupby("point", sort=False)):
        colour = PALETTE[i % len(PALETTE)]
        for k, name in enumerate(DEGREES_OF_FREEDOM):
            ax = axes[k % 3, k // 3]
            value, sigma = rows[name].to_numpy(float), rows[f"sigma_{name}"].to_numpy(float)
            ax.plot(rows["time_s"], value, color=colour, lw=0.9, label=str(point))
            ax.fill_between(rows["time_s"], value - 2 * sigma, value + 2 * sigma, color=colour, alpha=0.2, lw=0)
            ax.set_ylabel(f"{name} ({units if k < 3 else 'deg'})", fontsize=8)
    for ax in axes[-1]:
        clock_axis(ax)
    legend(axes[0, 0], fontsize=7)
    figure.suptitle(title, fontsize=10)
    return figure


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
