"""The rig and the targets in space from one side: the still twin of the view that turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.figures.drawing import INK, Axes, Drawing, new_drawing

TURN, TILT = -0.9, 0.42
"""rad, from where the view is seen: as the view that turns begins."""

MANY = 8
"""Beyond so many targets a legend is of no use."""

HULL, SURVEY = "#9aa5b1", "#7a8590"


def space(view: Mapping[str, Any], title: str) -> Drawing:
    """Cameras with their view, survey, calibrated volume and trajectories, at equal scales; view: of `space_view`.

    The arrows of x, y and z at the lowest corner are as long as the scale says.
    """
    drawing = new_drawing(width=9.0, height=5.4, title=title)
    (ax,) = drawing.axes
    ax.equal, ax.ticks = "limits", False
    points = view["points"]
    for i, j in view["hull"]:
        _line(ax, [points[i], points[j]], HULL, 0.7)
    if points:
        x, y = flat(np.array(points, float)).T
        ax.dots(x, y, SURVEY, size=3.5)
    for camera in view["cameras"]:
        corners = camera["corners"]
        _line(ax, [*corners, corners[0]], camera["colour"], 1.0)
        for corner in corners:
            _line(ax, [camera["centre"], corner], camera["colour"], 1.0)
        x, y = flat(np.array(camera["centre"], float))
        ax.word(x, y, camera["name"], camera["colour"])
    for track in view["tracks"]:
        label = track.get("name", "") if len(view["tracks"]) <= MANY else ""
        _line(ax, [p or [np.nan] * 3 for p in track["p"]], track["colour"], 1.6, label)
    ax.legend = True
    _axes(ax, view)
    return drawing


def flat(p: Array) -> Array:
    """Points (..., 3) as they are seen: (..., 2), to the right and up."""
    (ca, sa), (ce, se) = ((np.cos(v), np.sin(v)) for v in (TURN, TILT))
    return np.asarray(p @ np.array([[ca, -sa * se], [sa, ca * se], [0.0, ce]]))


def _axes(ax: Axes, view: Mapping[str, Any]) -> None:
    """x, y and z from the lowest corner of all points, each as long as a round number of units."""
    each = [p for p in view["points"] if p] + [p for track in view["tracks"] for p in track["p"] if p]
    if not each:
        return
    all_of = np.array(each, float)
    low, size = all_of.min(axis=0), float(np.ptp(all_of, axis=0).max())
    if not size > 0:
        return
    power = 10.0 ** np.floor(np.log10(size / 3))
    long = power * max(s for s in (1, 2, 5) if s * power <= size / 3 * 1.0001)
    for name, along in zip("xyz", np.eye(3), strict=True):
        end = low + long * along
        _line(ax, [low, end], INK, 1.4)
        x, y = flat(end)
        ax.word(x, y, name)
    ax.title = f"x, y and z at the corner are {long:g} {view['units']} long"


def _line(ax: Axes, points: Sequence[Any], colour: str, width: float, label: str = "") -> None:
    x, y = flat(np.array(points, float)).T
    ax.plot(x, y, colour, width=width, label=label)
