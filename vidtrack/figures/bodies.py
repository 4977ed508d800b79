"""Six degrees of freedom against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.figures.style import PALETTE, clock_axis, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def six_degrees(bodies: DataFrame, units: str, title: str) -> Figure:
    """x, y, z on the left, roll, pitch, yaw on the right, two standard deviations shaded; a colour a body."""
    return against_time(bodies, "body", ("x", "y", "z", "roll", "pitch", "yaw"), units, title)


def against_time(table: DataFrame, by: str, names: tuple[str, ...], units: str, title: str) -> Figure:
    """Six columns against time with two standard deviations (sigma_<name>): three lengths left, three angles right.

    by   the column whose values have a colour each
    """
    figure, axes = new_figure(3, 2, height=1.6, sharex=True)
    for i, (label, rows) in enumerate(table.groupby(by, sort=False)):
        colour = PALETTE[i % len(PALETTE)]
        for k, name in enumerate(names):
            ax = axes[k % 3, k // 3]
            value, sigma = rows[name].to_numpy(float), rows[f"sigma_{name}"].to_numpy(float)
            ax.plot(rows["time_s"], value, color=colour, lw=0.9, label=str(label))
            ax.fill_between(rows["time_s"], value - 2 * sigma, value + 2 * sigma, color=colour, alpha=0.2, lw=0)
            ax.set_ylabel(f"{name} ({units if k < 3 else 'deg'})", fontsize=8)
    for ax in axes[-1]:
        clock_axis(ax)
    legend(axes[0, 0], fontsize=7)
    figure.suptitle(title, fontsize=10)
    return figure
