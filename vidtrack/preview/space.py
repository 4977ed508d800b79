"""What the cameras of a run will know in space: sigma where the targets start, and whether that is among the points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.volume import distance_outside
from vidtrack.stages.calibrate import Calibration


class Expected(NamedTuple):
    """sigma (3,): world units, in the middle of the points; field: diagonal of what the cameras see there;
    starts: target: (where (3,), how far outside the points' volume, px by which a camera's line of sight misses it).
    """

    sigma: Array
    field: float
    starts: dict[str, tuple[Array, float, float]]


def expected(
    calibrations: Mapping[str, Calibration], centroids: Mapping[str, pd.DataFrame], named: Sequence[str]
) -> Expected:
    """What to expect of a run.

    centroids   camera: the table of its first moments
    named       targets whose names mean the same in all cameras
    """
    cameras = [calibrations[c].camera for c in centroids]
    known = [calibrations[c].uncertainty for c in centroids]
    parts = [calibrations[c].points for c in centroids]
    points = pd.concat([t[t["used"].astype(bool)] if "used" in t else t for t in parts])
    p = points[["x", "y", "z"]].drop_duplicates().to_numpy(float)
    middle = p.mean(0)
    sd = np.array([_sd(table) for table in centroids.values()])
    b = np.array([project(camera, middle) for camera in cameras])
    there = locate_points(cameras, b, sd=sd, uncertainties=known)
    starts = {}
    for name in named:
        seen = np.array([_first(table, name) for table in centroids.values()])
        fix = locate_points(cameras, seen, sd=sd)
        outside = distance_outside(p, fix.point)
        off = np.hypot(fix.error[..., 0], fix.error[..., 1])
        starts[name] = fix.point, float(outside or 0.0), float(np.max(off, initial=0.0, where=np.isfinite(off)))
    return Expected(there.sigma, float(np.mean([_diagonal(camera, middle) for camera in cameras])), starts)


def _sd(table: pd.DataFrame) -> float:
    sd = float(np.sqrt((table["sd_x"] ** 2 + table["sd_y"] ** 2).median() / 2))
    return sd if np.isfinite(sd) and sd > 0 else 0.1


def _first(table: pd.DataFrame, name: str) -> Array:
    rows = table[(table["target"] == name) & table["Xf"].notna()]
    return rows[["Xf", "Yf"]].to_numpy(float)[0] if len(rows) else np.full(2, np.nan)


def _diagonal(camera: Camera, p: Array) -> float:
    """World units: the picture's diagonal at the distance of p."""
    depth = float(camera.R[2] @ p + camera.T[2])
    width, height = camera.image_size
    return depth / camera.f * float(np.hypot(width * camera.dx / camera.Sx, height * camera.dy))
