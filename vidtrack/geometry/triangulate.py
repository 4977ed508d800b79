"""Where points lie in the world, from where two or more cameras see them, and how well that is known.

Thesis 4.3.6 - 4.3.14; the equations are set up and solved in `sights`, block by block in `batch`. The covariance
of a fix carries the centroid noise and, where given, the uncertainty of the cameras' calibration. The latter is the
same for all samples of a run: it does not average out along a trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence
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
STEPS = 10
"""Of refinement, at most."""


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


def locate_points(
    cameras: Sequence[Camera],
    b: ArrayLike,
    *,
    sd: ArrayLike | None = None,
    uncertainties: Sequence[CameraUncertainty | None] | None = None,
    joint: ArrayLike | None = None,
    slips: ArrayLike | None = None,
    refine: bool = True,
    reject: ArrayLike | None = None,
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
    reject         px, a number or (n_cameras, ...) for each measurement; where any camera's reprojection error is
                   larger, the camera without which the others agree best is left out. None: nothing is left out
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
    task = Task(cameras, flat, weight, known, slipped, STEPS if refine else 0, most_unsure)

    used = np.isfinite(flat[..., 0] + flat[..., 1]) & (weight[..., 0] > 0) & (weight[..., 1] > 0)
    solved = task.solve(used)
    noise = 1.0 if sd is not None else _noise(solved, used)
    left_out = np.zeros(used.shape, bool)
    disagree = np.zeros(used.shape[1], bool)
    if reject is not None:
        limit = np.broadcast_to(np.asarray(reject, float), b.shape[:-1]).reshape(used.shape)
        suspect = np.flatnonzero(solved.worst(used, limit) > 1)
        keep, disagree[suspect] = agreeing(task.at(suspect), used[:, suspect], limit[:, suspect], noise)
        left_out[:, suspect] = used[:, suspect] & ~keep
        again = np.flatnonzero(left_out.any(0))
        solved.put(again, task.at(again).solve(used[:, again] & ~left_out[:, again]))
        solved.point[:, disagree] = np.nan
    return _located(solved, used & ~left_out, left_out, disagree, noise, sd, b.shape)


def places_of(cameras: Sequence[Camera], b: Array, sd: Array, *, most_unsure: float = MOST_UNSURE) -> Array:
    """The points (n, 3) of `locate_points` alone, world units; NaN where there is no fix.

    b   (n_cameras, n, 2) px, NaN where a camera lost the target; sd, of the same shape, px: its standard deviation
    """
    weight = _weights(sd, b.shape)
    used = np.isfinite(b[..., 0] + b[..., 1]) & (weight[..., 0] > 0) & (weight[..., 1] > 0)
    return np.ascontiguousarray(Task(cameras, b, weight, None, None, STEPS, most_unsure).points(used).T)


def _weights(sd: ArrayLike, shape: tuple[int, ...]) -> Array:
    """1/px^2 in b's shape; 0 where sd is NaN or infinite: such a measurement is not used."""
    s = np.asarray(sd, float)
    if s.ndim > len(shape) or (s <= 0).any():
        raise ValueError("sd must be positive, its leading axes as those of b")
    s = s.reshape(s.shape + (1,) * (len(shape) - s.ndim)) if s.ndim else s
    weight = np.square(s, out=np.empty_like(s))
    return np.broadcast_to(np.nan_to_num(np.divide(1, weight, out=weight), copy=False), shape)


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
