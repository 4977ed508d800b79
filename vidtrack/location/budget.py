"""Where the uncertainty of a located point comes from: survey, calibration, centroids, clocks.

The variance of a fix is a sum of parts (Guide to the Expression of Uncertainty in Measurement, 5.1.2): each is found by
locating the same samples with one part alone in their covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import locate_points

MOST = 120
"""Moments of each target that the budget is made of, evenly over the run: its parts change slowly."""

PARTS = ("survey", "calibration", "centroid", "clock")


def error_budget(
    cameras: Sequence[Camera],
    b: Array,
    sd: Array,
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    of_survey: Array | None,
    slips: Array | None,
) -> dict[str, Any]:
    """For each axis of the world the standard uncertainty of a position by part, of a usual (median) sample, world
    units.

    b, sd        (n_cameras, m, M, 2) px; slips likewise, or None; joint, of_survey: see `location.shared_survey`
    Keys: axes: {x, y, z: {survey, calibration, centroid, clock, combined}}; samples. None where no sample has a sigma.
    """
    every = max(1, -(-b.shape[2] // MOST))
    b, sd = b[:, :, ::every], sd[:, :, ::every]
    slipped = None if slips is None else slips[:, :, ::every]
    centroid = locate_points(cameras, b, sd=sd).covariance
    known = [u for u in uncertainties if u is not None]
    variance = {"centroid": _diagonal(centroid)}
    if known:
        whole = _diagonal(locate_points(cameras, b, sd=sd, uncertainties=uncertainties, joint=joint).covariance)
        part = np.zeros_like(whole)
        if of_survey is not None:
            located = locate_points(cameras, b, sd=sd, uncertainties=uncertainties, joint=of_survey)
            part = np.clip(_diagonal(located.covariance) - variance["centroid"], 0, None)
        both = np.clip(whole - variance["centroid"], 0, None)
        variance["survey"] = np.minimum(part, both)
        variance["calibration"] = both - variance["survey"]
    if slipped is not None:
        late = _diagonal(locate_points(cameras, b, sd=sd, slips=slipped).covariance)
        variance["clock"] = np.clip(late - variance["centroid"], 0, None)
    good = np.isfinite(variance["centroid"]).all(-1)
    for part in variance.values():
        good &= np.isfinite(part).all(-1)
    if not good.any():
        return {"axes": None, "samples": 0}
    usual = {name: np.median(v[good], 0) for name, v in variance.items()}
    axes = {
        axis: {name: float(np.sqrt(usual[name][i])) if name in usual else 0.0 for name in PARTS}
        | {"combined": float(np.sqrt(sum(v[i] for v in usual.values())))}
        for i, axis in enumerate("xyz")
    }
    return {"axes": axes, "samples": int(good.sum())}


def _diagonal(covariance: Array) -> Array:
    return np.asarray(np.diagonal(covariance, axis1=-2, axis2=-1))
