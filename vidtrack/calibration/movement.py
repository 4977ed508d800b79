"""Whether a camera moved between two sets of calibration points, how far, and how sure that is.

Two whole calibrations differ by more than the camera moved: f and the distance trade off against each other. So the
lens is held as it was before, and only the camera's pose is fitted to each set; what the lens does not know then
cancels, for it errs alike in both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.camera.refine import POSE, Fit, refine
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.rotation import rotation_from_vector

TURNS = ("tilt_down", "pan_right", "roll_clockwise")
"""How a camera turns about its own axes x, y and z, as seen from behind it."""


class Movement(NamedTuple):
    """How one camera moved."""

    shift: Array  # (3,) world units, of the perspective centre
    shift_sd: Array  # (3,)
    turn: Array  # (3,) deg, in the order of TURNS
    turn_sd: Array  # (3,) deg
    turn_in_place: Array  # (3,) deg, if the perspective centre stayed where it was, as under a sagging tilt motor
    turn_in_place_sd: Array  # (3,) deg, far smaller: no shift is there to undo it in the picture
    chi2: float  # of all six together: about 6 for a camera that stood still
    chi2_in_place: float  # what turning in place leaves unexplained: about 3 if that is what it did
    probability: float  # that a camera at rest would show as large a chi2
    picture_shift: Array  # (n,) px, how far the points' images moved
    before: Fit  # pose to the points before
    after: Fit  # pose to the points after


def movement(
    camera: Camera,
    before: tuple[Array, Array],
    after: tuple[Array, Array],
    *,
    sd: float | None = None,
    survey: tuple[ArrayLike, ArrayLike] | None = None,
) -> Movement:
    """Compare a camera's pose before and after, its lens held.

    camera  as calibrated before
    before  p (n, 3) world units and b (n, 2) px, finite; at least 3 points, not on one line
    after   the same of the second set; other points will do
    sd      px, centroid noise; None: from the residuals
    survey  world units, tolerance of each set's points
    The uncertainty counts the survey of each set as its own: balls hung anew.
    Raises ValueError for fewer than 4 points in a set or a pose that does not converge.
    """
    pivot = before[0].mean(0)
    camera = camera.with_(through=tuple(interface.held for interface in camera.through))
    fits = []
    for (p, b), tolerance in zip((before, after), survey or (None, None), strict=True):
        if len(p) < 4:
            raise ValueError(f"{len(p)} points; a pose needs 4 to be checked")
        fit = refine(camera, p, b, free=POSE, sd=sd, survey=tolerance, pivot=pivot)
        if not fit.converged:
            raise ValueError(f"the pose cannot be found: {fit.message}")
        fits.append(fit)
    old, new = fits
    step = _step(old.camera, new.camera, pivot)
    covariance = old.uncertainty.covariance + new.uncertainty.covariance
    information = np.linalg.inv(covariance)
    chi2 = float(step @ information @ step)
    cross = _cross(old.camera.R @ pivot + old.camera.T)
    position = np.hstack([-old.camera.R.T @ cross, -old.camera.R.T])  # d(pivot - R^T t) by omega and t
    in_place = np.vstack([np.eye(3), -cross])  # a turn about the perspective centre takes t along
    spread = np.linalg.inv(in_place.T @ information @ in_place)
    turn = spread @ in_place.T @ information @ step
    degrees = np.degrees(1) * np.array([1, -1, -1])  # points turn down when the camera turns up, and so on
    return Movement(
        shift=new.camera.position - old.camera.position,
        shift_sd=np.sqrt(np.diag(position @ covariance @ position.T)),
        turn=step[:3] * degrees,
        turn_sd=np.sqrt(np.diag(covariance)[:3]) * abs(degrees),
        turn_in_place=turn * degrees,
        turn_in_place_sd=np.sqrt(np.diag(spread)) * abs(degrees),
        chi2=chi2,
        chi2_in_place=chi2 - float(turn @ np.linalg.solve(spread, turn)),
        probability=_chi2_tail_of_six(chi2),
        picture_shift=np.linalg.norm(project(new.camera, after[0]) - project(old.camera, after[0]), axis=-1),
        before=old,
        after=new,
    )


def _step(old: Camera, new: Camera, pivot: Array) -> Array:
    """omega (rad) and t (world units) that lead from one pose to the other, (6,): see `vidtrack.geometry.jacobian`."""
    turn = new.R @ old.R.T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, (np.trace(turn) - 1) / 2)
    omega = axis * (angle / sine) if sine > 0 else axis
    assert np.allclose(rotation_from_vector(omega), turn, atol=1e-9), "no camera turns half way round unnoticed"
    return np.concatenate([omega, new.R @ pivot + new.T - old.R @ pivot - old.T])


def _cross(t: Array) -> Array:
    """The matrix (3, 3) whose product with a vector is t x vector."""
    return np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])


def _chi2_tail_of_six(chi2: float) -> float:
    """Probability that chi-squared of 6 degrees of freedom exceeds a value: e^-h (1 + h + h^2/2), h half of it."""
    h = chi2 / 2
    return float(np.exp(-h) * (1 + h + h * h / 2))
