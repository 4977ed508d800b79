"""Where the uncertainty of a located point comes from: survey, calibration, centroids, clocks.

The variance of a fix is a sum of parts (Guide to the Expression of Uncertainty in Measurement, 5.1.2): each is found by
locating the same samples with one part alone in their covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

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
"""Independent errors of the field that the calibration leaves with less than this share of the whole are left out."""

SETTLED = 1e-12
"""Share of a parameter's variance that those before it leave, below which they settle it: rounding makes as much."""

PLAIN = 0.5
"""Of an error's largest component, from which on one says its sign: the largest may have its negative beside it."""

STENCIL = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if np.abs(d).sum() < 3])
"""Places (19, 3), in shares of how far points lie apart, at which the curvature of the calibration's error is found."""

PARTS = ("survey", "calibration", "centroid", "clock")


def error_budget(
    cameras: Sequence[Camera],
    b: Array,
    sd: Array,
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    of_survey: Array | None,
    slips: Array | None,
    aged: Array | None = None,
    growth: float = 1.0,
    zoomed: Array | None = None,
) -> dict[str, Any]:
    """For each axis of the world the standard uncertainty of a position by part, of a usual (median) sample, world
    units.

    b, sd        (n_cameras, m, M, 2) px; slips likewise, or None
    joint, of_survey  as `location.sight_lines.shared_survey` has them
    aged         (m, M, 3, 3) what `location.cameras.seen_late` adds to the covariance; it counts as the clocks'
    zoomed       (m, M, 3, 3) what `location.cameras.zoom_in_sigma` adds; the calibration's, which it does not grow by
    growth       of sigma, by what lines of sight miss: nothing says which part it is of, so that all grow by it
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
    if aged is not None and aged.any():
        variance["clock"] = variance.get("clock", 0.0) + _diagonal(aged[:, ::every])
    good = np.isfinite(variance["centroid"]).all(-1)
    for part in variance.values():
        good &= np.isfinite(part).all(-1)
    if not good.any():
        return {"axes": None, "samples": 0}
    usual = {name: growth**2 * np.median(v[good], 0) for name, v in variance.items()}
    if zoomed is not None:
        usual["calibration"] = usual.get("calibration", 0.0) + np.median(_diagonal(zoomed[:, ::every])[good], 0)
    axes = {
        axis: {name: float(np.sqrt(usual[name][i])) if name in usual else 0.0 for name in PARTS}
        | {"combined": float(np.sqrt(sum(v[i] for v in usual.values())))}
        for i, axis in enumerate("xyz")
    }
    return {"axes": axes, "samples": int(good.sum())}


class CalibrationField(NamedTuple):
    """How unsure the calibration leaves scale, axes and straightness: independent errors (n) of positions,

        error = e0 + sum u_k (G_k d + 1/2 d H_k d),  d = p - about

    with u_k of variance 1 and the same for all samples of a run; the largest first. Rotated among themselves (sums of
    u_k) they would be the same field: these are its principal ones, so that rounding does not choose.

    gradients    (n, 3, 3)     G; along the directions in which points lie apart, and 0 across
    curvatures   (n, 3, 3, 3)  H, 1 / world units: by how much G changes with the place; by the first index the error's
    about        (3,)          world units, the mean of the points
    """

    gradients: Array
    curvatures: Array
    about: Array


def calibration_field(
    cameras: Sequence[Camera], points: Array, uncertainties: Sequence[CameraUncertainty | None], joint: Array | None
) -> CalibrationField | None:
    """The error field that the calibration leaves about the points (..., 3) that were located, world units.

    None where no calibration is uncertain, or fewer than 4 points are known.
    """
    known = [i for i, u in enumerate(uncertainties) if u is not None]
    p = points.reshape(-1, 3)
    p = p[np.isfinite(p).all(-1)]
    p = p[:: max(1, len(p) // SPREAD)]
    if not known or len(p) < 4:
        return None
    about = p.mean(0)
    reach = max(float(np.sqrt(((p - about) ** 2).sum(1).mean())), 1e-12)
    n = len(p)
    p = np.concatenate([p, about + reach * STENCIL])
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
    directions = [v for v in _root(covariance).T if v.any()]
    b = np.stack([project(camera, p) for camera in cameras])
    at = locate_points(cameras, b, sd=1.0, most_unsure=np.inf).point
    apart = at[:n] - np.nanmean(at[:n], 0)
    moved = np.repeat(b[:, None], len(directions), 1)
    for k, i in enumerate(known):
        for each_moved, v in zip(moved[i], directions, strict=True):
            each_moved -= J[k] @ v[edges[k] : edges[k + 1]]
    first, second = [], []
    for shift in locate_points(cameras, moved, sd=1.0, most_unsure=np.inf).point - at:
        good = np.isfinite(shift[:n]).all(-1) & np.isfinite(apart).all(-1)
        if good.sum() > 3:
            G, *_ = np.linalg.lstsq(apart[good], shift[:n][good] - shift[:n][good].mean(0), rcond=FLAT)
            first.append(G.T)
            second.append(_curvature(shift[n:]) / reach**2)
    if not first:
        return None
    G, H = _principal(np.stack(first), np.stack(second), reach)
    return CalibrationField(G, H, about)


def _root(C: Array) -> Array:
    """L, lower triangular, with L L' = C (k, k), by Cholesky; 0 in the column of a parameter that others settle.

    It follows C without a jump. Eigenvectors do not where variances are nearly equal; and where their units differ, as
    px and rad do, those of small variances are what rounding makes of the large ones.
    """
    size = np.sqrt(np.diag(C))
    unit = np.where(size > 0, size, 1.0)
    R, L = C / np.outer(unit, unit), np.zeros_like(C)
    for j in range(len(C)):
        left = R[j, j] - L[j, :j] @ L[j, :j]
        if left > SETTLED:
            L[j:, j] = (R[j:, j] - L[j:, :j] @ L[j, :j]) / np.sqrt(left)
    return np.asarray(size[:, None] * L)


def _principal(G: Array, H: Array, reach: float) -> tuple[Array, Array]:
    """The principal ones of independent errors, gradients (n, 3, 3) and curvatures (n, 3, 3, 3), the largest first.

    reach  world units from the middle, at which they are compared
    """
    n, scale = len(G), reach / 2
    s, own = np.linalg.svd(np.hstack([G.reshape(n, -1), scale * H.reshape(n, -1)]), full_matrices=False)[1:]
    kept = s**2 > SMALL * (s**2).sum()
    own = s[kept, None] * own[kept]
    size = np.abs(own)
    first = (size >= PLAIN * size.max(1, keepdims=True)).argmax(1)
    own = own * np.sign(own[np.arange(len(own)), first])[:, None]
    return own[:, :9].reshape(-1, 3, 3), own[:, 9:].reshape(-1, 3, 3, 3) / scale


def _curvature(shift: Array) -> Array:
    """Second derivatives (3, 3, 3) of errors (19, 3) at the points of the stencil; 0 where one of them is not seen."""
    if not np.isfinite(shift).all():
        return np.zeros((3, 3, 3))
    x, y, z = STENCIL.T
    terms = np.column_stack([np.ones(len(x)), x, y, z, x * x / 2, y * y / 2, z * z / 2, x * y, x * z, y * z])
    fitted, *_ = np.linalg.lstsq(terms, shift, rcond=None)
    xx, yy, zz, xy, xz, yz = fitted[4:]
    return np.stack([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)


def _diagonal(covariance: Array) -> Array:
    return np.asarray(np.diagonal(covariance, axis1=-2, axis2=-1))
