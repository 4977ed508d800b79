"""Where a line of sight of one camera runs through the picture of another."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, line_of_sight, project

STEPS = 160
"""Points of a curve."""


def epipolar_curve(a: Camera, b: Camera, seen: tuple[float, float], about: Array) -> list[list[list[float]]]:
    """The curve in b's frame buffer of what a sees at `seen` (px), as polylines of points [Xf, Yf] inside the picture.

    about   (n, 3) world points; the line of sight is drawn from a quarter of their nearest distance to four times the
            farthest
    A curve, not a line: both lenses distort, and water bends what is seen through glass.
    """
    start, direction = line_of_sight(a, np.asarray(seen, float))
    along = (about - start) @ direction
    along = along[along > 0]
    if not len(along):
        return []
    steps = np.geomspace(0.25 * along.min(), 4 * along.max(), STEPS)
    b_px = project(b, start + steps[:, None] * direction)
    width, height = b.image_size
    room = 0.1 * width
    inside = (b_px > -room) & (b_px < np.array([width, height]) + room)  # NaN is not
    good = np.asarray(inside.all(axis=1), bool)
    parts: list[list[list[float]]] = []
    for i in np.flatnonzero(good).tolist():
        if not i or not good[i - 1]:
            parts.append([])
        parts[-1].append([round(float(v), 2) for v in b_px[i]])
    return [part for part in parts if len(part) > 1]
