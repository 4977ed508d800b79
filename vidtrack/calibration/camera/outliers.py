"""Distinguish inliers from outliers among calibration points before the outliers pull the camera.

One wrong point in 64 bends a least-squares camera by more than all the noise together, and then hides in the bend.
So a first camera comes from random small samples, judged by the better part of the points only; from there the
set of inliers grows and shrinks with a camera fitted to it, by a scale that outliers cannot move. Each residual is
judged by its own variance: a fit follows a point of high leverage (few neighbours, the rim of the picture) and leaves
little of its error, and it predicts such a point badly where it was not fitted.
Sources: Fischler and Bolles (1981); Rousseeuw's least trimmed squares with concentration steps (1999); Cook and
Weisberg (1982) for leverage.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.dlt import dlt, homography, project_dlt, project_homography
from vidtrack.calibration.camera.tsai import centred, plane_axes

Mask = NDArray[np.bool_]

ENOUGH = 12
"""Points below which a bad one cannot be distinguished from a camera that fits too well."""

MAJORITY = 0.6
"""Share of the points that judges a sample: up to 4 in 10 may be bad."""

MOST_JUDGES = 300
"""Points that judge the samples, where there are more."""

SMALLEST_SCALE = 0.05
"""ASSUME: px, no centroid and lens model together are better than this: exact (simulated) points are not rejected over
rounding, nor those at the rim of a wide lens over a third of a pixel."""

FALSE_ALARMS = 1e-3
"""Good points rejected, on average, in a whole calibration, were the noise normal."""

LEAST_REDUNDANCY = 0.02
"""Share of its own variance that is left to a residual at least: below, rounding and the lens model decide."""

HEAVY_TAILS = 1.25
"""ASSUME: real noise strays somewhat farther than normal noise, and no lens model is quite right at the rim."""


class Mixup(NamedTuple):
    """A bad point that lies where another tag should be."""

    point: int
    place: int  # index of the tag whose place it is
    mutual: bool  # the other lies at this one's place: a swap


def majority(p: ArrayLike, b: ArrayLike, *, rng: np.random.Generator, samples: int = 200) -> Mask:
    """The points, (n,) True, that agree best on a camera without a lens: the better 60 % of n.

    p (n, 3) world units, b (n, 2) px, all finite; n >= ENOUGH. Points in one plane are taken as such.
    Each sample's camera is judged by the median of its distances; the best few are fitted again to the points nearest
    to them until those stay the same.
    Raises ValueError for too few points.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    n = len(p)
    if n < ENOUGH:
        raise ValueError(f"{n} points are too few to find bad ones among; {ENOUGH} are needed")
    fit, distance, least = _methods(p)
    judges = np.sort(rng.permutation(n)[:MOST_JUDGES])
    keep = max(int(np.ceil(MAJORITY * len(judges))), least + 2)
    draws = rng.random((samples, len(judges))).argpartition(least, axis=1)[:, : least + 1]
    x, u = p[judges], b[judges]
    off = distance(fit(x[draws], u[draws]), x, u)  # (samples, judges)
    best = np.argsort(np.partition(off, keep - 1, axis=1)[:, keep - 1])[:8]
    trusted = np.argpartition(off[best], keep - 1, axis=1)[:, :keep]
    for _ in range(10):
        off = distance(fit(x[trusted], u[trusted]), x, u)
        again = np.argpartition(off, keep - 1, axis=1)[:, :keep]
        if (np.sort(again) == np.sort(trusted)).all():
            break
        trusted = again
    spread = (np.partition(off, keep - 1, axis=1)[:, :keep] ** 2).sum(1)
    chosen = trusted[np.argmin(spread)]
    everyone = distance(fit(x[chosen], u[chosen]), p, b)
    mask = np.zeros(n, bool)
    mask[np.argsort(everyone, kind="stable")[: int(np.ceil(MAJORITY * n))]] = True
    return mask


Fitter = Callable[[Array, Array], Array]


def _methods(p: Array) -> tuple[Fitter, Callable[[Array, Array, Array], Array], int]:
    """How to fit matrices to samples and measure distances (px), and how many points a fit needs."""
    _, q, _ = centred(p)
    s = np.linalg.svd(q, compute_uv=False)
    if s[2] >= 0.02 * s[0]:
        return dlt, _distance_from_dlt, 6
    axes = plane_axes(q)[:2]
    middle = p.mean(0)

    def flat(x: Array) -> Array:
        return np.asarray((x - middle) @ axes.T)

    def fit(x: Array, b: Array) -> Array:
        return homography(flat(x), b)

    def distance(H: Array, x: Array, b: Array) -> Array:
        return _length(b - project_homography(H, flat(x)))

    return fit, distance, 4


def _distance_from_dlt(P: Array, p: Array, b: Array) -> Array:
    return _length(b - project_dlt(P, p))


def _length(off: Array) -> Array:
    length = np.sqrt((off**2).sum(-1))
    return np.asarray(np.where(np.isfinite(length), length, 1e12))


def robust_scale(distances: ArrayLike, n_parameters: int = 0) -> float:
    """Noise of one coordinate, from the median of distances (n,) in the plane, unmoved by bad ones.

    For normal noise the median of the squared distance is 2 ln 2 variances. The distances are those of `studentised`,
    so that fitting has not shrunk them; Rousseeuw's factor 1 + 5 / (redundancy) allows for chance in few points.
    """
    r = np.asarray(distances, float)
    redundancy = max(2 * r.size - n_parameters, 2)
    return float(np.median(r) / np.sqrt(2 * np.log(2)) * (1 + 5 / redundancy))


def studentised(residuals: Array, J: Array, fitted: Mask) -> Array:
    """Lengths (n,), px, of residuals (n, 2), each divided by its own standard deviation in units of the noise.

    J        (n, 2, k) derivatives of the projections by the parameters that were fitted
    fitted   (n,) the points of the fit
    With H = J_i (J^T J)^-1 J_i^T of the fitted points the residual of a fitted point has the covariance I - H, that of
    another one I + H. inf where a point does not project.
    """
    seen = np.isfinite(residuals).all(-1)
    A = J[fitted & seen].reshape(-1, J.shape[-1])
    if not len(A):  # no fitted point projects: the fit went astray
        return np.full(len(residuals), np.inf)
    size = np.linalg.norm(A, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, s, Vt = np.linalg.svd(A / size, full_matrices=False)
    root = Vt[s > 1e-9 * s[0]].T / s[s > 1e-9 * s[0]]  # root root^T = (A^T A)^-1
    own = np.nan_to_num(J / size) @ root
    H = own @ np.swapaxes(own, -1, -2)
    values, axes = np.linalg.eigh(H)
    variance = np.where(fitted[:, None], np.maximum(1 - values, LEAST_REDUNDANCY), 1 + values)
    along = (np.nan_to_num(residuals)[:, None, :] @ axes)[:, 0]
    return np.where(seen, np.sqrt((along**2 / variance).sum(-1)), np.inf)


def limit_for(n: int) -> float:
    """How many times the scale a distance may be, so that n good points lose FALSE_ALARMS of them on average.

    A distance in the plane exceeds t standard deviations with probability exp(-t^2 / 2): 4.7 for 64 points, and
    5.9 with the allowance for heavy tails.
    """
    return HEAVY_TAILS * float(np.sqrt(2 * np.log(max(n, 1) / FALSE_ALARMS)))


def trusted(
    start: Mask,
    distances: Callable[[Mask], Array],
    *,
    n_parameters: int,
    floor: float = SMALLEST_SCALE,
    rounds: int = 20,
) -> tuple[Mask, Array, float]:
    """The inliers: fit, measure all, keep those within the limit, until the set stays the same.

    start       (n,) points to begin with
    distances   gives the distances (n,), px (or px over the sd expected), of all points from a camera fitted to a set;
                inf where a point does not project
    Returns the set, the last distances and the scale. The scale comes from the better 3 in 4 of all points in effect
    (a median), so that points can return as well as go.
    """
    keep = start
    seen: list[Mask] = []
    for _ in range(rounds):
        r = distances(keep)
        scale = max(robust_scale(r, n_parameters), floor)
        again = r <= limit_for(len(r)) * scale
        if (again == keep).all():
            return again, r, scale
        if any((again == old).all() for old in seen):  # points that belong only while they are left out
            return again & keep, r, scale
        seen.append(keep)
        keep = again
    return keep, r, scale


def mixups(projected: ArrayLike, b: ArrayLike, bad: Mask, tolerance: float) -> list[Mixup]:
    """Bad points that lie where another tag should be.

    projected   (n, 2) px, where each point should be; b (n, 2) px, where it was measured; bad (n,)
    tolerance   px, how near to the other tag's place; and at most a third of the way from its own
    Two that lie at each other's places are a swap, reported as mutual.
    """
    projected, b = np.asarray(projected, float), np.asarray(b, float)
    index = np.flatnonzero(bad)
    if not index.size:
        return []
    away = np.sqrt(((b[index, None] - projected) ** 2).sum(-1))  # (bad, n)
    own = away[np.arange(index.size), index]
    away[np.arange(index.size), index] = np.inf
    away = np.where(np.isfinite(away), away, np.inf)
    nearest = away.argmin(1)
    hit = away.min(1) <= np.minimum(tolerance, np.where(np.isfinite(own), own, np.inf) / 3)
    place = dict(zip(index[hit].tolist(), nearest[hit].tolist(), strict=True))
    return [Mixup(i, j, place.get(j) == i) for i, j in place.items()]
