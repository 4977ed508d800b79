"""Where targets went: x, y, z against time with their uncertainty, seen from above and from the side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.drawing import Axes, Drawing, new_drawing
from vidtrack.figures.style import AXIS_COLOURS, PALETTE, REJECTED_COLOUR

if TYPE_CHECKING:
    from pandas import DataFrame

MANY = 8
"""Beyond so many targets a legend is of no use."""


def against_time(trajectories: DataFrame, units: str, title: str) -> Drawing:
    """x, y and z of every target against time, two standard deviations shaded."""
    axes_shown = [a for a in "xyz" if trajectories[a].notna().any()] or ["x"]
    drawing = new_drawing(len(axes_shown), 1, height=1.9, shared=True, title=title)
    for i, (target, rows) in enumerate(trajectories.groupby("target", sort=False)):
        colour = PALETTE[i % len(PALETTE)]
        for ax, axis in zip(drawing.axes, axes_shown, strict=True):
            ax.around(rows["time_s"], rows[axis], 2 * rows[f"sigma_{axis}"], colour)
            ax.plot(rows["time_s"], rows[axis], colour, width=1.0, label=str(target))
            ax.ylabel = f"{axis} ({units})"
    first, last = drawing.axes[0], drawing.axes[-1]
    _flagged(first, trajectories, axes_shown[0])
    last.clock()
    for ax in drawing.axes:
        ax.x_first = last.x_first
    first.legend = bool(1 < trajectories["target"].nunique() <= MANY or trajectories[axes_shown[0]].isna().any())
    return drawing


def views(trajectories: DataFrame, units: str, title: str, points: DataFrame | None = None) -> Drawing:
    """The paths from above (x, y) and from the side (x, z), at equal scales, among the calibration points."""
    pairs = [p for p in (("x", "y"), ("x", "z")) if trajectories[p[1]].notna().any()] or [("x", "y")]
    drawing = new_drawing(1, len(pairs), height=3.6, title=title)
    for ax, (across, up) in zip(drawing.axes, pairs, strict=True):
        if points is not None:
            ax.dots(points[across], points[up], "#9aa5b1", size=5.0, label="calibration points")
        for i, (target, rows) in enumerate(trajectories.groupby("target", sort=False)):
            ax.plot(rows[across], rows[up], PALETTE[i % len(PALETTE)], label=str(target))
        ax.equal = "limits"
        ax.xlabel, ax.ylabel = f"{across} ({units})", f"{up} ({units})"
    drawing.axes[0].legend = bool(trajectories["target"].nunique() <= MANY)
    return drawing


def derivatives(kinematics: DataFrame, units: str, title: str) -> Drawing:
    """Velocity and acceleration of the run's first target by axis.

    At the ends of a record their uncertainty may be many times the motion: samples flagged edge are dots, and the
    scale is that of the others.
    """
    rows = kinematics[kinematics["target"] == kinematics["target"].iloc[0]]
    axes_shown = [a for a in "xyz" if rows[f"v{a}"].notna().any()] or ["x"]
    sure, time_s = ~rows["flag"].str.contains("edge", regex=False).to_numpy(bool), rows["time_s"].to_numpy(float)
    drawing = new_drawing(2, 1, height=2.0, shared=True, title=f"{title}, target {rows['target'].iloc[0]}")
    for ax, letter in zip(drawing.axes, "va", strict=True):
        for axis in axes_shown:
            value = rows[letter + axis].to_numpy(float)
            ax.plot(time_s, np.where(sure, value, np.nan), AXIS_COLOURS[axis], width=1.0, label=axis)
        if any(np.isfinite(line.y).any() for line in ax.lines):
            ax.ylim = ax.bounds()[1]
        for axis in axes_shown:
            value = rows[letter + axis].to_numpy(float)
            ax.dots(time_s, np.where(sure, np.nan, value), AXIS_COLOURS[axis], size=2.0)
    speed, rate = drawing.axes
    speed.ylabel, rate.ylabel = f"velocity ({units}/s)", f"acceleration ({units}/s²)"
    rate.clock()
    speed.x_first, speed.legend = rate.x_first, True
    return drawing


def _flagged(ax: Axes, trajectories: DataFrame, axis: str) -> None:
    """Lost samples as ticks at the foot of the first axes, so that a gap is visible."""
    lost = trajectories.loc[trajectories[axis].isna(), "time_s"].to_numpy(float)
    if lost.size:
        foot = np.nanmin(trajectories[axis].to_numpy(float)) if trajectories[axis].notna().any() else 0.0
        ax.dots(lost, np.full(lost.size, foot), REJECTED_COLOUR, mark="|", size=8.0, label="lost")
