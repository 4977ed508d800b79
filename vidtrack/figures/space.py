"""The rig and the targets in space from one side: the still twin of the view that turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def space(view: Mapping[str, Any], title: str) -> Figure:
    """Cameras with their view, survey, calibrated volume and trajectories, at equal scales; view: of `space_view`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained", dpi=110)
    ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    points = view["points"]
    for i, j in view["hull"]:
        _line(ax, [points[i], points[j]], "#cccccc", 0.6)
    if points:
        ax.scatter(*np.array(points, float).T, s=3, color="#777777", depthshade=False)
    for camera in view["cameras"]:
        corners = camera["corners"]
        _line(ax, [*corners, corners[0]], camera["colour"], 0.8)
        for corner in corners:
            _line(ax, [camera["centre"], corner], camera["colour"], 0.8)
        ax.text(*camera["centre"], f" {camera['name']}", color=camera["colour"], fontsize=8)
    for track in view["tracks"]:
        _line(ax, [p or [np.nan] * 3 for p in track["p"]], track["colour"], 1.2)
    ax.set_aspect("equal")
    ax.tick_params(labelsize=7)
    for axis in "xyz":
        getattr(ax, f"set_{axis}label")(f"{axis} ({view['units']})", fontsize=8)
    ax.set_title(title, fontsize=10)
    return figure


def _line(ax: Any, points: Sequence[Any], colour: str, width: float) -> None:
    ax.plot(*np.array(points, float).T, color=colour, lw=width)
