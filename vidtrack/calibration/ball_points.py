"""Calibration balls as points: each moved from the middle of its outline to the image of its own middle."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.ball_perspective import outline_offset
from vidtrack.geometry.camera import Camera, line_of_sight


class Columns(Protocol):
    """A table: its columns by name."""

    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: str, /) -> bool: ...


def ball_radii(table: Columns) -> Array:
    """The radius (n,), px, of each ball of a table of sightings; NaN where that is not known, and what is no ball.

    By column width, its apparent diameter; where that is not known by pixels, those above the threshold. A point that
    was placed by hand, a board's corner or a line of a file without sizes has neither. Of a table with a column flat,
    its points are flat marks.
    """
    n = len(table["Xf"])
    if "flat" in table:
        return np.full(n, np.nan)
    pixels = np.asarray(table["pixels"], float) if "pixels" in table else np.full(n, np.nan)
    width = np.asarray(table["width"], float) if "width" in table else np.full(n, np.nan)
    by_pixels = np.sqrt(np.where(pixels > 0, pixels, np.nan) / np.pi)
    return np.where(width > 0, width / 2, by_pixels)


def ball_offsets(camera: Camera, p: Array, b: Array, radius: Array) -> Array:
    """How far the middles of outlines (n, 2), px, lie off the images of balls at p (n, 3), seen at b (n, 2) px."""
    return outline_offset(camera, b, radius, way_in_the_last_medium(camera, p, b))


def way_in_the_last_medium(camera: Camera, p: Array, b: Array) -> Array | None:
    """World units (n,), from the last interface to points p (n, 3), seen at b (n, 2); None without interfaces."""
    return np.asarray(np.linalg.norm(p - line_of_sight(camera, b)[0], axis=-1)) if camera.through else None


def perspective_record(camera: Camera, p: Array, b: Array, offset: Array, radius: Array) -> dict[str, Any]:
    """What was corrected, for camera.json: how many balls, the largest offset and radius (px) of the points (n, 3)."""
    known = radius > 0
    way = way_in_the_last_medium(camera, p, b)
    record: dict[str, Any] = {
        "balls": int(known.sum()),
        "largest_px": float(np.hypot(*offset.T).max(initial=0.0)),
        "radius_px": float(np.median(radius[known])) if known.any() else None,
    }
    return record if way is None else record | {"distance": float(np.nanmedian(way))}
