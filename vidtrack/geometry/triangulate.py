"""Where points lie in the world, from where two or more cameras see them, and how well that is known.

Thesis 4.3.6 - 4.3.14; the equations are set up and solved in `sights`, block by block in `batch`. The covariance
of a fix carries the centroid noise and, where given, the uncertainty of the cameras' calibration. The latter is the
same for all samples of a run: it does not average out along a trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.batch import Solution, Task
from vidtrack.geometry.calibration_error import CalibrationErrors, CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.leave_one_out import agreeing
from vidtrack.geometry.sights import Mask
from vidtrack.geometry.symmetric import full

MOST_UNSURE = 0.25
"""ASSUME: a fix whose sigma is a larger share of its distance is none: linear laws no longer hold for it."""


class Fix(NamedTuple):
    """What `triangulate` returns."""

    point: Array  # (..., 3)
    miss: Array  # (...)
    n_cameras: NDArray[np.intp]  # (...)


class Located(NamedTuple):
    """What `locate_points` returns; world units and px."""

    point: Array  # (..., 3); NaN where there is no fix
    covariance: Array  # (..., 3, 3); centroid noise and calibration
    sigma: Array  # (..., 3) square roots of the covariance's diagonal
    miss: Array  # (...) rms distance from the point to its lines of sight
    n_cameras: NDArray[np.intp]  # (...) cameras that the fix rests on; 0 where there is none
    left_out: Mask  # (n_cameras, ...) saw the target, but disagreed
    disagree: Mask  # (...) cameras disagree and it cannot be decided which is right: no fix
    error: Array  # (n_cameras, ..., 2) measured minus projected, px, for every camera that saw the target
    sd: float  # px: the centroid noise given (NaN where it varies) or found


def triangulate(origins: ArrayLike, directions: ArrayLike, *, min_angle_deg: float = 2.0) -> Fix:
    """Find the point nearest, in the least-squares sense, to several lines of sight: the textbook's form.

    The stages use `locate_points`, which weighs each camera and gives the covariance.

    Exact lines would meet; measured ones pass close by. The rms distance that
    remains, the miss, shows how far to trust the fix.

    origins     (..., n_cameras, 3)  perspective centres, world units
    directions  (..., n_cameras, 3)  unit vectors; a row of NaN is a camera that lost the target
    Returns Fix(point (..., 3), miss (...), n_cameras (...)); NaN where fewer than two cameras saw the
    target or their lines are within min_angle_deg of parallel.
    Raises ValueError for shapes that do not match or a direction that is not a unit vector.
    Lines along x through (0, 0, 0) and along y through (0, 0, 2) give (0, 0, 1) with a miss of 1.
    """
    o, d = np.asarray(origins, float), np.asarray(directions, float)
    if d.ndim < 2 or o.ndim < 2 or d.shape[-1] != 3 or o.shape[-2:] != d.shape[-2:]:
        raise ValueError(f"origins and directions must be (..., n_cameras, 3), not {o.shape} and {d.shape}")
    o, d = np.broadcast_arrays(o, d)
    seen = np.isfinite(d).all(-1)
    if not np.allclose(np.sum(d * d, -1)[seen], 1, atol=1e-6):
        raise ValueError("directions must be unit vectors")
    d = np.where(seen[..., None], d, 0.0)
    # I - d d^T takes the part of a vector across the line
    across = (np.eye(3) - d[..., :, None] * d[..., None, :]) * seen[..., None, None]
    N = across.sum(-3)
    n = seen.sum(-1)
    good = (n >= 2) & (_largest_angle([d[..., i, :] for i in range(d.shape[-2])]) >= np.radians(min_angle_deg))
    N = np.where(good[..., None, None], N, np.eye(3))
    middle = o.mean(-2)  # solved about the cameras' middle: nothing is lost far from the world's origin
    arm = o - middle[..., None, :]
    p = np.linalg.solve(N, (across @ arm[..., None]).sum(-3))[..., 0]
    off = (across @ (p[..., None, :] - arm)[..., None])[..., 0]
    miss = np.sqrt(np.sum(off**2, (-1, -2)) / np.maximum(n, 1))
    return Fix(np.where(good[..., None], p + middle, np.nan), np.where(good, miss, np.nan), n)


def _largest_angle(directions: Sequence[Array]) -> Array:
    """The largest angle, rad, between any two of n unit vectors (..., 3) taken as lines; (0, 0, 0) is none."""
    sine2 = np.zeros(directions[0].shape[:-1])
    for a, b in combinations(directions, 2):
        seen = (a != 0).any(-1) & (b != 0).any(-1)
        sine2 = np.maximum(sine2, np.where(seen, 1 - np.sum(a * b, -1) ** 2, 0))
    return np.arcsin(np.sqrt(np.clip(sine2, 0, 1)))


def locate_points(
    cameras: Sequence[Camera],
    b: ArrayLike,
    *,
    sd: ArrayLike | None = None,
    uncertainties: Sequence[CameraUncertainty | None] | None = None,
    joint: ArrayLike | None = None,
    slips: ArrayLike | None = None,
    refine: bool = True,
    reject: float | None = None,
    most_unsure: float = MOST_UNSURE,
) -> Located:
    """Locate points that several cameras see at the same moments, with the covariance of each.

    cameras        n_cameras of them
    b              (n_cameras, ..., 2)  frame buffer px; NaN where a camera lost the target
    sd             px, standard deviation of the centroids: a number, or its own leading axes as b's, so that
                   (n_cameras,) gives each camera its own. None: found from the reprojection errors of all points
                   together; sigma is NaN with fewer than 10 redundant measurements
    uncertainties  a calibration uncertainty (or None) for each camera; adds to the covariance
    joint          covariance (k, k) of the parameters of all cameras that have an uncertainty, one camera after the
                   other, where their errors are not independent (see `shared_survey`)
    slips          (n_cameras, ..., 2)  px by which each camera's centroid would move with one standard error of that
                   camera's clock; adds to the covariance
    refine         minimise the weighted reprojection error instead of the thesis's algebraic one
    reject         px; where any camera's reprojection error is larger, the camera without which the others agree
                   best is left out. None: nothing is left out
    most_unsure    the largest sigma of a fix, as a share of its distance to the nearest camera
    Returns Located. NaN where fewer than two cameras saw the target, their lines are so nearly parallel that sigma
    (without sd: that of 1 px of noise) is beyond most_unsure,
    the point falls behind a camera, or cameras disagree and it cannot be decided which one errs (`disagree`;
    two cameras never can).
    Raises ValueError for fewer than two cameras or shapes that do not match.
    Equations 4.3.6 - 4.3.14. Two cameras at right angles, 0.25 in/px each and 0.1 px noise: sigma is .025 in across
    one line of sight only and .018 in where both see.
    """
    b = np.asarray(b, float)
    if len(cameras) < 2 or b.ndim < 2 or b.shape[0] != len(cameras) or b.shape[-1] != 2:
        raise ValueError(f"b must be (n_cameras, ..., 2) for at least two cameras, not {b.shape} for {len(cameras)}")
    if uncertainties is not None and len(uncertainties) != len(cameras):
        raise ValueError(f"{len(uncertainties)} uncertainties for {len(cameras)} cameras")
    flat = b.reshape(len(cameras), -1, 2)
    weight = _weights(1.0 if sd is None else sd, b.shape).reshape(flat.shape)
    known = CalibrationErrors(cameras, uncertainties, joint) if uncertainties is not None else None
    slipped = None if slips is None else np.nan_to_num(np.broadcast_to(slips, b.shape)).reshape(flat.shape)
    task = Task(cameras, flat, weight, known, slipped, 10 if refine else 0, most_unsure)

    used = np.isfinite(flat[..., 0] + flat[..., 1]) & (weight[..., 0] > 0) & (weight[..., 1] > 0)
    solved = task.solve(used)
    noise = 1.0 if sd is not None else _noise(solved, used)
    left_out = np.zeros(used.shape, bool)
    disagree = np.zeros(used.shape[1], bool)
    if reject is not None:
        suspect = np.flatnonzero(solved.worst(used) > reject)
        keep, disagree[suspect] = agreeing(task.at(suspect), used[:, suspect], reject, noise)
        left_out[:, suspect] = used[:, suspect] & ~keep
        again = np.flatnonzero(left_out.any(0))
        solved.put(again, task.at(again).solve(used[:, again] & ~left_out[:, again]))
        solved.point[:, disagree] = np.nan
    return _located(solved, used & ~left_out, left_out, disagree, noise, sd, b.shape)


def _weights(sd: ArrayLike, shape: tuple[int, ...]) -> Array:
    """1/px^2 in b's shape; 0 where sd is NaN or infinite: such a measurement is not used."""
    s = np.asarray(sd, float)
    if s.ndim > len(shape) or (s <= 0).any():
        raise ValueError("sd must be positive, its leading axes as those of b")
    s = s.reshape(s.shape + (1,) * (len(shape) - s.ndim)) if s.ndim else s
    return np.broadcast_to(np.nan_to_num(1 / s**2), shape)


def _noise(solved: Solution, used: Mask) -> float:
    """The centroid noise, px, estimated from the reprojection errors of all points; outliers do not count.

    Each point has 2 n_cameras - 3 redundant measurements. NaN for fewer than 10 of them.
    """
    found = np.isfinite(solved.point[0])
    spare = 2.0 * used.sum(0)[found] - 3
    chi2 = solved.chi2[found]
    if spare.sum() < 10:
        return float("nan")
    variance = float(np.median(chi2 / spare)) / 0.6  # start: a little wide of the median of chi2 over its freedom
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * variance
        new = float(chi2[good].sum() / spare[good].sum())
        if abs(new - variance) <= 1e-9 * new:
            break
        variance = new
    return float(np.sqrt(variance))


def _located(
    solved: Solution,
    used: Mask,
    left_out: Mask,
    disagree: Mask,
    noise: float,
    sd: ArrayLike | None,
    shape: tuple[int, ...],
) -> Located:
    points = shape[1:-1]
    lost = np.isnan(solved.point[0])
    S = solved.noise * noise**2 + solved.common
    S[:, lost] = np.nan
    if sd is not None:
        noise = float(np.asarray(sd, float).item()) if np.size(sd) == 1 else float("nan")
    return Located(
        np.ascontiguousarray(solved.point.T).reshape(*points, 3),
        full(S).reshape(*points, 3, 3),
        np.sqrt(S[:3].T).reshape(*points, 3),
        np.where(lost & ~disagree, np.nan, solved.miss).reshape(points),
        np.where(lost, 0, used.sum(0)).reshape(points),
        left_out.reshape(shape[:-1]),
        disagree.reshape(points),
        np.moveaxis(solved.error, 1, -1).reshape(shape),
        noise,
    )
