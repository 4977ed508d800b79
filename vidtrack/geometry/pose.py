"""Where an unknown camera stands, from as few as three points: a fit in which expectation makes up for what is missing.

Labelling needs a camera long before there are points enough to calibrate one. So every parameter is free from
the start, with a wide prior: few points move the attitude and leave the lens as lenses usually are; with more
points the data take over. One model grows by itself, and its covariance says how far from the seeds a
prediction is reliable. The answer predicts where balls are; it is no calibration.

Pixels are square units here: dx = dy = 1, f in px, Sx the ratio of the pixels' sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import PARAMETERS, derivatives, stepped

# ASSUME: focal lengths from half to several picture widths, pixels within 30 % of square, the optical axis
# within a quarter of the picture from its middle, distortion within a fifth at the side of the picture.
LOG_F_SD, LOG_SX_SD, CENTRE_SD, RADIAL_SD, DECENTRING_SD, SKEW_SD = 1.0, 0.15, 0.12, 0.1, 0.01, 0.01
F_STARTS = (0.7, 1.5, 3.5, 10.0)
"""Focal lengths to start from, in picture widths."""
PLAIN, RICH = 11, 15
"""How many parameters (of jacobian.PARAMETERS) are free: attitude, f, Sx, centre, kappa1; and kappa2, p1, p2, skew."""
HUBER = 2.5
"""sd, the length of a residual beyond which it counts in proportion and no longer by its square."""
_NAMES = ("Cx", "Cy", "kappa1", "kappa2", "p1", "p2", "skew")


class Pose(NamedTuple):
    """A camera, how well it is known, and how well it fits.

    covariance   (k, k), of the steps (omega, t, log f, log Sx, Cx, Cy, kappa1...) about `pivot`
    cost         half the sum of squares, residuals (Huber) and priors, no unit
    residuals    (n, 2) px, measured minus projected
    """

    camera: Camera
    covariance: Array
    pivot: Array
    cost: float
    residuals: Array


def starting_poses(
    p: ArrayLike, b: ArrayLike, image_size: tuple[int, int], f_starts: Sequence[float] = F_STARTS
) -> list[Camera]:
    """Cameras of several focal lengths that see world points p (n, 3) near frame buffer positions b (n, 2) px.

    n >= 3, not on one line. Coplanar points have two attitudes each (the plane tips toward or away); both are given.
    """
    import cv2

    p, b = np.asarray(p, float), np.asarray(b, float)
    centre = p.mean(0)
    scale = float(np.abs(p - centre).max()) or 1.0
    points = np.ascontiguousarray((p - centre) / scale)
    spread = np.linalg.svd(points, compute_uv=False)
    flat = len(p) > 3 and spread[2] < 0.01 * spread[0]
    width, height = image_size
    cameras = []
    for f in f_starts:
        K = np.array([[f * width, 0, (width - 1) / 2], [0, f * width, (height - 1) / 2], [0, 0, 1.0]])
        for method in (cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_SQPNP) if flat else (cv2.SOLVEPNP_SQPNP,):
            try:
                _, turns, shifts, _ = cv2.solvePnPGeneric(points, b[:, None, :].copy(), K, None, flags=method)
            except cv2.error:  # a degenerate view for this method; the others still answer
                continue
            for turn, shift in zip(turns, shifts, strict=True):
                R = cv2.Rodrigues(turn)[0]
                if np.isfinite(R).all() and np.isfinite(shift).all():
                    T = shift[:, 0] * scale - R @ centre
                    cameras.append(Camera(K[0, 2], K[1, 2], 1, 1, 1, K[0, 0], 0.0, R, T, image_size))
    return cameras


def poses(
    p: ArrayLike, b: ArrayLike, sd: ArrayLike, image_size: tuple[int, int], f_starts: Sequence[float] = F_STARTS
) -> list[Pose]:
    """Every distinct pose that explains the points, best first; see `starting_poses` and `adjust`."""
    p, b = np.asarray(p, float), np.asarray(b, float)
    starts = [adjust(camera, p, b, sd, iterations=4) for camera in starting_poses(p, b, image_size, f_starts)]
    found: list[Pose] = []
    going_on, iterations = (8, 25) if len(p) < 8 else (2, 8)  # many points leave little to choose, and lead there fast
    for start in _different(pose for pose in starts if pose)[:going_on]:
        pose = adjust(start.camera, p, b, sd, iterations=iterations)
        if pose is not None:
            found.append(pose)
    return _different(found)


def _different(found: Iterable[Pose]) -> list[Pose]:
    """Poses, best first, without those like a better one: copies, alike in cost to the last digits, would crowd out
    others."""
    kept: list[Pose] = []
    for pose in sorted(found, key=lambda pose: pose.cost):
        if not any(_alike(pose, other) for other in kept):
            kept.append(pose)
    return kept


def adjust(
    camera: Camera, p: ArrayLike, b: ArrayLike, sd: ArrayLike, *, terms: int = PLAIN, iterations: int = 25
) -> Pose | None:
    """The most likely camera for world points p (n, 3) seen at b (n, 2) px, from a start; None where it fails.

    sd  px, of each coordinate of b, scalar or (n,)
    Levenberg-Marquardt on the Huber cost of the residuals plus the priors. Points behind the camera are a failure.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    sd = np.broadcast_to(np.asarray(sd, float), len(p))
    pivot = p.mean(0)
    prior = _prior(camera.image_size, terms)
    damping, best = 1e-3, _cost(camera, p, b, sd, prior)
    if not np.isfinite(best):
        return None
    for _ in range(iterations):
        A, g = _normal(camera, p, b, sd, pivot, prior)
        before, trial = best, None
        while trial is None and damping < 1e8:
            try:
                step: Array = np.asarray(np.linalg.solve(A + damping * np.diag(np.diag(A)), g), float)
            except np.linalg.LinAlgError:  # points that leave an attitude open
                return None
            trial = _moved(camera, pivot, step, prior.scale)
            cost = _cost(trial, p, b, sd, prior) if trial else np.inf
            if cost >= best:
                trial, damping = None, 8 * damping
        if trial is None:
            break
        camera, best, damping = trial, cost, max(damping / 8, 1e-9)
        if before - best < 1e-5 * (1 + before):
            break
    A, _ = _normal(camera, p, b, sd, pivot, prior)
    return Pose(camera, np.asarray(np.linalg.pinv(A, hermitian=True), float), pivot, best, b - project(camera, p))


def predicted(pose: Pose, p: ArrayLike) -> tuple[Array, Array]:
    """Where the camera sees world points (n, 3): px (n, 2), and the covariance (n, 2, 2) px^2; NaN where unseen."""
    at = derivatives(pose.camera, p, pose.pivot)
    terms = len(pose.covariance)
    J = at.by_parameter[..., :terms] * _steps(pose.camera, _prior(pose.camera.image_size, terms).scale)
    return at.projected, J @ pose.covariance @ np.swapaxes(J, -1, -2)


class _Prior(NamedTuple):
    mean: Array
    precision: Array
    scale: Array


def _prior(image_size: tuple[int, int], terms: int) -> _Prior:
    """Mean and precision of the free parameters, and the unit in which each is stepped; attitude has precision 0."""
    width, height = image_size
    half = width / 2
    mean = np.array([0] * 6 + [np.log(1.5 * width), 0, (width - 1) / 2, (height - 1) / 2, 0, 0, 0, 0, 0])
    sd = np.array(
        [np.inf] * 6
        + [LOG_F_SD, LOG_SX_SD, CENTRE_SD * width, CENTRE_SD * width]
        + [RADIAL_SD, RADIAL_SD, DECENTRING_SD, DECENTRING_SD, SKEW_SD]
    )
    scale = np.array([1.0] * 10 + [half**-2, half**-4, 1 / half, 1 / half, 1.0])
    return _Prior(mean[:terms], sd[:terms] ** -2, scale[:terms])


def _steps(camera: Camera, scale: Array) -> Array:
    """What one unit of each free parameter changes in the camera's own parameter: f and Sx step by their logarithm."""
    step = scale.copy()
    step[6], step[7] = camera.f, camera.Sx
    return step


def _values(camera: Camera, scale: Array) -> Array:
    lens = np.array([getattr(camera, name) for name in _NAMES])[: len(scale) - 8]
    return np.concatenate([np.zeros(6), [np.log(camera.f), np.log(camera.Sx)], lens / scale[8:]])


def _moved(camera: Camera, pivot: Array, step: Array, scale: Array) -> Camera | None:
    if not np.isfinite(step).all() or np.abs(step[6:8]).max() > 3 or np.abs(step[:3]).max() > 3:
        return None
    attitude = dict(zip(("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z"), step[:6].tolist(), strict=True))
    lens = dict(zip(_NAMES, (step * scale)[8:].tolist(), strict=False))
    turned = stepped(camera, pivot, {**attitude, **lens})
    return turned.with_(f=camera.f * np.exp(step[6]), Sx=camera.Sx * np.exp(step[7]))


def _normal(camera: Camera, p: Array, b: Array, sd: Array, pivot: Array, prior: _Prior) -> tuple[Array, Array]:
    at = derivatives(camera, p, pivot, PARAMETERS[: len(prior.mean)])
    r = (b - at.projected) / sd[:, None]
    J = at.by_parameter[..., : len(prior.mean)] * (_steps(camera, prior.scale) / sd[:, None, None])
    weight = 1 / np.maximum(1, np.hypot(r[:, 0], r[:, 1]) / HUBER)
    A = np.einsum("nik,nil,n->kl", J, J, weight) + np.diag(prior.precision)
    g = np.einsum("nik,ni,n->k", J, r, weight) - prior.precision * (_values(camera, prior.scale) - prior.mean)
    return A, g


def _cost(camera: Camera, p: Array, b: Array, sd: Array, prior: _Prior) -> float:
    r = np.linalg.norm(b - project(camera, p), axis=-1) / sd
    if not np.isfinite(r).all():
        return np.inf
    robust = np.where(r < HUBER, 0.5 * r * r, HUBER * (r - 0.5 * HUBER))
    off = _values(camera, prior.scale) - prior.mean
    return float(robust.sum() + 0.5 * (prior.precision * off**2).sum())


def _alike(a: Pose, b: Pose) -> bool:
    turn = np.arccos(np.clip((np.trace(a.camera.R @ b.camera.R.T) - 1) / 2, -1, 1))
    return bool(turn < 0.1 and abs(np.log(a.camera.f / b.camera.f)) < 0.4)
