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
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.triangulate import locate_points

MOST = 120
"""Moments of each target that the budget is made of, evenly over the run: its parts change slowly."""

SPREAD = 40
"""Points, about, by which the gradient of the calibration's error is found."""

FLAT = 0.02
"""Directions in which points spread by less than this share of their largest spread have no gradient of their own."""

SMALL = 1e-4
"""Directions of the calibration's error with less than this share of the whole are left out."""

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


def calibration_gradients(
    cameras: Sequence[Camera], points: Array, uncertainties: Sequence[CameraUncertainty | None], joint: Array | None
) -> Array | None:
    """How unsure the calibration leaves scale and axes: matrices G_k (n, 3, 3) in  error = e0 + sum u_k G_k (p - mean).

    points   (..., 3) located, world units; G holds along the directions in which they lie apart, and is 0 across
    The u_k are independent, of variance 1, and the same for all samples of a run: a displacement a is unsure by the
    root of the sum of squares of G_k a. None where no calibration is uncertain.
    """
    known = [i for i, u in enumerate(uncertainties) if u is not None]
    p = points.reshape(-1, 3)
    p = p[np.isfinite(p).all(-1)]
    p = p[:: max(1, len(p) // SPREAD)]
    if not known or len(p) < 4:
        return None
    J = []
    for i in known:
        u = uncertainties[i]
        assert u is not None
        which = columns(cameras[i], u.names)
        J.append(np.nan_to_num(derivatives(cameras[i], p, u.pivot).by_parameter[..., which]))
    edges = np.cumsum([0, *(j.shape[-1] for j in J)])
    covariance = np.zeros((edges[-1], edges[-1])) if joint is None else np.asarray(joint, float)
    if joint is None:
        for k, i in enumerate(known):
            u = uncertainties[i]
            assert u is not None
            covariance[edges[k] : edges[k + 1], edges[k] : edges[k + 1]] = u.covariance
    if not np.isfinite(covariance).all():
        return None
    # parameters that are off by v look like pictures that are off by J v
    values, vectors = np.linalg.eigh(covariance)
    b = np.stack([project(camera, p) for camera in cameras])
    at = locate_points(cameras, b, sd=1.0, most_unsure=np.inf).point
    apart = at - np.nanmean(at, 0)
    found = []
    for value, v in zip(values, vectors.T, strict=True):
        if value <= 0:
            continue
        moved = b.copy()
        for k, i in enumerate(known):
            moved[i] -= J[k] @ (np.sqrt(value) * v[edges[k] : edges[k + 1]])
        shift = locate_points(cameras, moved, sd=1.0, most_unsure=np.inf).point - at
        good = np.isfinite(shift).all(-1) & np.isfinite(apart).all(-1)
        if good.sum() > 3:
            G, *_ = np.linalg.lstsq(apart[good], shift[good] - shift[good].mean(0), rcond=FLAT)
            found.append(G.T)
    if not found:
        return None
    each = np.stack(found)
    size = (each**2).sum((1, 2))
    return np.asarray(each[size > SMALL * size.sum()])


def _diagonal(covariance: Array) -> Array:
    return np.asarray(np.diagonal(covariance, axis1=-2, axis2=-1))
