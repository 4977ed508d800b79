"""Held-out errors: how well points are located by cameras that were calibrated without them.

Training errors mislead both ways: a rich lens model fits the survey's errors and looks better than it is; a plain
one leaves the survey's errors in its residuals and looks worse. So the points are divided into folds, every camera
is refitted without each fold, and the fold's points are located by those cameras (cross validation).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.tied_cameras import TiedCameras
from vidtrack.calibration.adjustment.unknowns import Names
from vidtrack.calibration.assessment.refit import CameraRefit
from vidtrack.calibration.bundle import cameras_only
from vidtrack.calibration.camera.gates import FLAT, flatness
from vidtrack.calibration.camera.initial_fit import appearing
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form
from vidtrack.calibration.normal_equations import Priors
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points

Mask = NDArray[np.bool_]

Refit = Callable[[Mask], Sequence[Camera]]
"""From which points to use (n,) to the cameras fitted to them; ValueError where they are too few."""

LEAVE_ONE_OUT_UP_TO = 128
"""Points up to which each is left out by itself; above, ten folds give the same for less work."""


class HeldOut(NamedTuple):
    """What `held_out` returns for n points and m cameras."""

    located: Array  # (n, 3) world units; NaN where fewer than two cameras see the point or its fold could not be fitted
    error: Array  # (n, 3) located minus surveyed
    error_of_all: Array  # (n, 3) the same by all sights, those that the calibration left out too
    sight_error: Array  # (m, n, 2) measured minus projected through cameras that never saw the point, px
    fold: NDArray[np.intp]  # (n,) which points were left out together
    method: str  # "leave-one-out" or "10-fold"


def held_out(
    p: ArrayLike, b: ArrayLike, refit: Refit, *, folds: int | None = None, b_all: ArrayLike | None = None
) -> HeldOut:
    """Refit without each fold in turn and locate its points.

    p      (n, 3) surveyed world points
    b      (m, n, 2) px; NaN where a camera does not show the point or does not use it
    refit  fits the m cameras to some of the points: see `refit_alone`, `refit_together`, `refit_closed_form`
    b_all  (m, n, 2) px, with the sights that the calibration left out; default: b
    folds  how many; default: each point by itself up to 128 points, else ten
    The error holds the survey error of the held-out point as well as the calibration's and the centroids'.
    The points are dealt into folds in an order that is shuffled, so that a fold is no row of the target, and is the
    same every time.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    n = len(p)
    k = min(n, folds or (n if n <= LEAVE_ONE_OUT_UP_TO else 10))
    fold = np.random.default_rng(0).permutation(n) % k
    located, sight_error = np.full((n, 3), np.nan), np.full(b.shape, np.nan)
    whole = b if b_all is None else np.asarray(b_all, float)
    by_all = np.full((n, 3), np.nan)
    for i in range(k):
        out = fold == i
        try:
            cameras = refit(~out)
        except ValueError:  # what is left does not settle the cameras: these points stay without an answer
            continue
        for j, camera in enumerate(cameras):
            sight_error[j, out] = b[j, out] - project(camera, p[out])
        if len(cameras) > 1:
            located[out] = locate_points(cameras, b[:, out], sd=1.0).point
            by_all[out] = locate_points(cameras, whole[:, out], sd=1.0).point
    method = "leave-one-out" if k == n else f"{k}-fold"
    return HeldOut(located, located - p, by_all - p, sight_error, fold, method)


def refit_alone(
    cameras: Sequence[Camera],
    p: Array,
    b: Array,
    *,
    free: Names,
    survey: ArrayLike | None = None,
    sd: float | None = None,
    priors: Priors | None = None,
) -> Refit:
    """Refine every camera on its own, starting where the fit to all points ended (see `refine`).

    The first Gauss-Newton step takes the left-out points' share out of the normal equations of all points; exact
    steps follow until one is below a hundredth of a standard error.
    sd   px, centroid noise; None: from what the cameras leave over
    """
    tolerance = np.zeros(len(p)) if survey is None else np.broadcast_to(np.asarray(survey, float), len(p))
    known = priors or [{} for _ in cameras]
    warm = [
        CameraRefit(camera, p, sights, tuple(names), tolerance, sd, prior)
        for camera, sights, names, prior in zip(cameras, b, free, known, strict=True)
    ]
    return lambda keep: [each.without(~keep) for each in warm]


def refit_together(
    cameras: Sequence[Camera],
    p: Array,
    b: Array,
    *,
    free: Names,
    sigma: ArrayLike,
    sd: ArrayLike,
    priors: Priors | None = None,
    tied: Sequence[TiedCameras] = (),
) -> Refit:
    """Refine all cameras and the survey together (see `bundle`), with the centroid noise sd that all points showed.

    tied  what a board says of the cameras, which no fold leaves out
    """
    spread = np.broadcast_to(np.asarray(sd, float), b.shape)
    tolerance = np.broadcast_to(np.asarray(sigma, float), len(p))

    def refit(keep: Mask) -> tuple[Camera, ...]:
        how: dict[str, Any] = {"sigma": tolerance[keep], "sd": spread[:, keep], "free": free, "priors": priors}
        return cameras_only(cameras, p[keep], b[:, keep], tied=tied, **how)

    return refit


def refit_closed_form(cameras: Sequence[Camera], p: Array, b: Array) -> Refit:
    """Tsai's closed form again, with the Cx, Cy, dx, dy that each camera has.

    Where they were searched (`centre`), the search has seen the held-out points: two numbers a camera, a trifle.
    """

    def refit(keep: Mask) -> list[Camera]:
        fitted = []
        for camera, sights in zip(cameras, b, strict=True):
            use = keep & np.isfinite(sights).all(-1)
            given = {"Cx": camera.Cx, "Cy": camera.Cy, "dx": camera.dx, "dy": camera.dy}
            seen = appearing(camera, p[use])
            solution = closed_form(seen, sights[use], **given, coplanar=flatness(p[use]) < FLAT)
            fitted.append(camera_from_closed_form(solution, camera.image_size).with_(through=camera.through))
        return fitted

    return refit
