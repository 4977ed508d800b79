"""Where targets went: x, y, z against time with their uncertainty, seen from above and from the side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.style import AXIS_COLOURS, PALETTE, clock_axis, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

MANY = 8
"""Beyond so many targets a legend is of no use."""


def against_time(trajectories: DataFrame, units: str, title: str) -> Figure:
    """x, y and z of every target against time, two standard deviations shaded."""
    axes_shown = [a for a in "xyz" if trajectories[a].notna().any()] or ["x"]
    figure, axes = new_figure(len(axes_shown), 1, height=1.9, sharex=True, squeeze=False)
    for i, (target, rows) in enumerate(trajectories.groupby("target", sort=False)):
        colour = PALETTE[i % len(PALETTE)]
        t = rows["time_s"].to_numpy(float)
        for ax, axis in zip(axes[:, 0], axes_shown, strict=True):
            value, sigma = rows[axis].to_numpy(float), rows[f"sigma_{axis}"].to_numpy(float)
            ax.plot(t, value, color=colour, lw=0.9, label=str(target))
            ax.fill_between(t, value - 2 * sigma, value + 2 * sigma, color=colour, alpha=0.2, lw=0)
            ax.set_ylabel(f"{axis} ({units})", fontsize=8)
    _flagged(axes[0, 0], trajectories, axes_shown[0])
    clock_axis(axes[-1, 0])
    if 1 < trajectories["target"].nunique() <= MANY or trajectories[axes_shown[0]].isna().any():
        legend(axes[0, 0], fontsize=7, ncols=8, loc="upper right")
    axes[0, 0].set_title(title, fontsize=10)
    return figure


def views(trajectories: DataFrame, units: str, title: str, points: DataFrame | None = None) -> Figure:
    """The paths from above (x, y) and from the side (x, z), at equal scales, among the calibration points."""
    pairs = [p for p in (("x", "y"), ("x", "z")) if trajectories[p[1]].notna().any()] or [("x", "y")]
    figure, axes = new_figure(1, len(pairs), height=3.6, squeeze=False)
    for ax, (across, up) in zip(axes[0], pairs, strict=True):
        if points is not None:
            label = "calibration points"
            ax.plot(points[across], points[up], ".", color="#bbbbbb", ms=4, label=label)
        for i, (target, rows) in enumerate(trajectories.groupby("target", sort=False)):
            ax.plot(rows[across], rows[up], color=PALETTE[i % len(PALETTE)], lw=0.9, label=str(target))
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"{across} ({units})", fontsize=8)
        ax.set_ylabel(f"{up} ({units})", fontsize=8)
    if trajectories["target"].nunique() <= MANY:
        legend(axes[0, 0], fontsize=7)
    figure.suptitle(title, fontsize=10)
    return figure


def derivatives(kinematics: DataFrame, units: str, title: str) -> Figure:
    """Velocity and acceleration of the run's first target by axis.

    At the ends of a record their uncertainty may be many times the motion: samples flagged edge are dots, and the
    scale is that of the others.
    """
    rows = kinematics[kinematics["target"] == kinematics["target"].iloc[0]]
    axes_shown = [a for a in "xyz" if rows[f"v{a}"].notna().any()] or ["x"]
    sure = ~rows["flag"].str.contains("edge", regex=False)
    figure, axes = new_figure(2, 1, height=2.0, sharex=True)
    for ax, letter in zip(axes, "va", strict=True):
        for axis in axes_shown:
            value, colour = rows[letter + axis], AXIS_COLOURS[axis]
            ax.plot(rows["time_s"], value.where(sure), color=colour, lw=0.9, label=axis)
        ax.set_ylim(ax.get_ylim())
        for axis in axes_shown:
            value, colour = rows[letter + axis], AXIS_COLOURS[axis]
            ax.plot(rows["time_s"], value.where(~sure), ".", color=colour, ms=1.5)
    axes[0].set_ylabel(f"velocity ({units}/s)", fontsize=8)
    axes[1].set_ylabel(f"acceleration ({units}/s$^2$)", fontsize=8)
    clock_axis(axes[1])
    legend(axes[0], fontsize=7, ncols=3, loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2)
    axes[0].set_title(f"{title}, target {rows['target'].iloc[0]}", fontsize=10)
    return figure


def _flagged(ax: object, trajectories: DataFrame, axis: str) -> None:
    """Lost samples as ticks at the foot of the first axes, so that a gap is visible."""
    lost = trajectories.loc[trajectories[axis].isna(), "time_s"].to_numpy(float)
    if lost.size:
        foot = np.nanmin(trajectories[axis].to_numpy(float))
        ax.plot(lost, np.full(lost.size, foot), "|", color="#B00020", ms=6, label="lost")  # type: ignore[attr-defined]
