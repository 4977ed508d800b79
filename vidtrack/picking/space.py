"""Where a line of sight of one camera runs through the picture of another."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project, undistorted_from_frame_buffer

STEPS = 160
"""Points of a curve."""


def epipolar_curve(a: Camera, b: Camera, seen: tuple[float, float], about: Array) -> list[list[list[float]]]:
    """The curve in b's frame buffer of what a sees at `seen` (px), as polylines of points [Xf, Yf] inside the picture.

    about   (n, 3) world points; the line of sight is drawn from a quarter of their nearest depth to four times the
            farthest
    A curve, not a line: both lenses distort.
    """
    depths = (about @ a.R.T + a.T)[:, 2]
    depths = depths[depths > 0]
    if not len(depths):
        return []
    u = undistorted_from_frame_buffer(a, np.asarray(seen, float)) / a.f
    z = np.geomspace(0.25 * depths.min(), 4 * depths.max(), STEPS)
    c = z[:, None] * np.array([u[0], u[1], 1.0])
    b_px = project(b, (c - a.T) @ a.R)
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
