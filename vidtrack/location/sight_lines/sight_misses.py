"""How far lines of sight miss the points located from them, beside what noise and calibration lead to expect; and why.

Residuals and what an error leaves in them: `sight_system`. What a cause takes away of the squared residuals is the
evidence for it; what it moves the positions by, over their sigma, is what it matters, however few px that is:
`sight_causes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.triangulate import Located, locate_points
from vidtrack.location.sight_lines.sight_causes import BIAS_PX, LIKELY_TURN, Cause, causes, likeliest
from vidtrack.location.sight_lines.sight_system import (
    SightSystem,
    by_camera_px,
    calibration_of,
    left_by,
    over_sigma,
    root_of,
    sight_system,
)

MOST = 400
"""Samples, evenly spread over all targets, that are looked at."""

FEWEST = 10
"""Samples below which nothing is said."""

LIKELY_LATE_S, LIKELY_READOUT_S = 0.5, 0.05
"""ASSUME: s, how late a clock and how long a read-out is before anything is known of it."""


class Misses(NamedTuple):
    """What `sight_misses` returns.

    n            samples looked at
    px           (n_cameras,) rms residual of each camera, px, weighted by 1 / sd^2
    expected_px  (n_cameras,) the same as noise and calibration lead to expect
    beyond       rms of the position errors that the residuals stand for, each over the sigma of its sample
    cause        the likeliest
    late         of each clock behind the first camera's, beside turns
    speed        rms speed of the samples in the pictures, px/s
    readout      of a rolling shutter, beside turns and late clocks
    """

    n: int
    px: Array
    expected_px: Array
    beyond: float
    cause: Cause
    late: Array  # (n_cameras, 2) s and its standard error; see `_late`
    speed: float
    readout: Array  # (n_cameras, 2) s and its standard error: what is left of each camera's read-out; see `_readouts`


class _Motion(NamedTuple):
    """The n samples that are looked at, by camera."""

    b: Array  # (c, n, 2) px
    velocity: Array  # (c, n, 2) px/s
    acceleration: Array  # (c, n, 2) px/s^2
    share: Array  # (c, n) of the read-out
    sd: Array  # (c, n, 2) px


def sight_misses(
    cameras: Sequence[Camera],
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    located: Located,
    b: Array,
    sd: Array,
    at: Array,
    shares: Array | None = None,
) -> Misses | None:
    """How the residuals of a run go with what is known of noise and calibration; None for fewer than ten samples.

    joint   (k, k) covariance of the parameters of all cameras with an uncertainty; None: cameras are independent
    b, sd   (n_cameras, m, T, 2)  px, at (T,) s
    shares  (n_cameras, m, T) of each camera's read-out after which a sample was seen; None: no read-out is estimated
    """
    used = np.isfinite(located.error[..., 0]) & ~located.left_out & np.isfinite(located.sigma[..., 0])
    where = np.argwhere(used.sum(0) >= 2)
    if len(where) < FEWEST:
        return None
    target, moment = where[np.linspace(0, len(where) - 1, min(len(where), MOST)).round().astype(int)].T
    on = used[:, target, moment]
    p = located.point[target, moment]
    system = sight_system(cameras, p, located, target, moment, on, sd)
    A, C = calibration_of(cameras, uncertainties, joint, p, system)
    px = by_camera_px(system.e**2, system.sd)
    variance = np.einsum("njj->nj", system.H) + np.einsum("njk,kl,njl->nj", A, C, A)
    expected = by_camera_px(variance, system.sd)
    spare = 2 * on.sum(0) / (2 * on.sum(0) - 3)
    implied = np.einsum("nij,nj->n", system.G**2, system.e**2) * spare
    velocity = np.gradient(b, at, axis=2)[:, target, moment] if at.size > 1 else np.zeros((*on.shape, 2))
    cause = likeliest(causes(cameras, system, p, velocity, at[moment], A, C))
    late = _late(cameras, system, p, np.nan_to_num(velocity), A, C)
    readout = np.full((len(cameras), 2), np.nan)
    if shares is not None:
        acceleration = np.gradient(np.gradient(b, at, axis=2), at, axis=2)[:, target, moment]
        own = _Motion(b[:, target, moment], velocity, acceleration, shares[:, target, moment], sd[:, target, moment])
        readout = _readouts(cameras, own, p, on, (A, C))
    return Misses(
        len(p), px, expected, over_sigma(system, implied), cause, late, _speed(np.nan_to_num(velocity)), readout
    )


def with_misses(located: Located, whole: Located, misses: Misses | None) -> tuple[Located, float]:
    """Positions whose sigma holds what the residuals of the run stand for; and by how much it grew, of a usual sample.

    whole  that of which the misses are. Where they stand for more than noise and calibration lead to expect, nothing
           says which of its errors grew: all of sigma does, as Birge's ratio of the run has it.
    """
    if misses is None or not misses.beyond > 1:
        return located, 1.0
    needed, sigma = (np.sqrt((own.sigma**2).sum(-1)) for own in (whole, located))
    known = np.isfinite(needed) & np.isfinite(sigma) & (sigma > 0)
    growth = np.ones(sigma.shape)
    growth[known] = np.maximum(misses.beyond * needed[known] / sigma[known], 1.0)
    covariance = located.covariance * np.square(growth)[..., None, None]
    usual = float(np.median(growth[known])) if known.any() else 1.0
    return located._replace(covariance=covariance, sigma=located.sigma * growth[..., None]), usual


def _readouts(
    cameras: Sequence[Camera], motion: _Motion, p: Array, on: NDArray[np.bool_], known: tuple[Array, Array]
) -> Array:
    """Each camera's read-out and its standard error (n_cameras, 2), s, fitted beside all turns and late clocks.

    A target that stays in the same rows shows no more than a late clock, and cameras that all see it in the same rows
    show only how their read-outs differ: the standard error shows that. Linear in small delays, and so
    repeated with what was found taken out.
    """
    velocity, acceleration = np.nan_to_num(motion.velocity), np.nan_to_num(motion.acceleration)
    share, (A, C) = np.nan_to_num(motion.share, nan=0.5), known
    every, sample = np.zeros(len(p), np.intp), np.arange(len(p))
    AL = A.reshape(A.shape[0] * A.shape[1], len(C)) @ root_of(C)
    total, sd = np.zeros(len(cameras)), np.zeros(len(cameras))
    for _ in range(4):
        d = (total[:, None] * share)[..., None]
        moved = np.where(on[..., None], motion.b - velocity * d + acceleration * d**2 / 2, np.nan)[:, None]
        located = locate_points(list(cameras), moved, sd=motion.sd[:, None])
        good = np.isfinite(located.point[0]).all(-1)
        if good.sum() < FEWEST:
            return np.full((len(cameras), 2), np.nan)
        p = np.where(good[:, None], located.point[0], p)
        system = sight_system(cameras, p, located, every, sample, on & good, motion.sd[:, None])
        step, sd = _readout_step(cameras, system, p, velocity - acceleration * d, share, AL)
        total = total + step
    return np.stack([total, sd], -1)


def _readout_step(
    cameras: Sequence[Camera], system: SightSystem, p: Array, velocity: Array, share: Array, AL: Array
) -> tuple[Array, Array]:
    """How much longer each read-out is than supposed, (n_cameras,) s, and its standard error.

    AL   (2 c n, k)  how residuals follow the calibration's error in units of its own covariance
    """
    columns, prior = [], []
    for i, camera in enumerate(cameras):
        v = velocity[i][..., None]
        columns.append(left_by(system, i, np.concatenate([_turn(camera, p), v, v * share[i][:, None, None]], -1)))
        prior += [1 / LIKELY_TURN**2] * 3 + [1 / LIKELY_LATE_S**2, 1 / LIKELY_READOUT_S**2]
    x, sd = _fitted(system, columns, prior, AL)
    return x[4::5], np.hypot(sd[4::5], BIAS_PX / _speed(velocity))


def _late(cameras: Sequence[Camera], system: SightSystem, p: Array, velocity: Array, A: Array, C: Array) -> Array:
    """How late each clock is behind that of the first camera, and its standard error (n_cameras, 2), s.

    Fitted beside the turns of all cameras, linear in a small delay. What moves along the epipolar lines alone shows no
    delay: the standard error shows that.
    """
    columns, prior = [], []
    for i, camera in enumerate(cameras):
        late = [velocity[i][..., None]] if i else []
        columns.append(left_by(system, i, np.concatenate([_turn(camera, p), *late], -1)))
        prior += [1 / LIKELY_TURN**2] * 3 + [1 / LIKELY_LATE_S**2] * len(late)
    x, sd = _fitted(system, columns, prior, A.reshape(A.shape[0] * A.shape[1], len(C)) @ root_of(C))
    own = np.stack([x[6::4], np.hypot(sd[6::4], BIAS_PX / _speed(velocity))], -1)
    return np.concatenate([np.zeros((1, 2)), own])


def _turn(camera: Camera, p: Array) -> Array:
    return np.nan_to_num(derivatives(camera, p, camera.position, ()).by_parameter[..., :3])


def _speed(velocity: Array) -> float:
    return max(float(np.sqrt((velocity**2).sum(-1).mean())), 1e-9)


def _fitted(system: SightSystem, columns: Sequence[Array], prior: Sequence[float], AL: Array) -> tuple[Array, Array]:
    """What explains the residuals best, beside the calibration's error, and its standard error: both (k,).

    columns  for each camera (n, 2 c, k_c), what its quantities leave in the residuals
    prior    1 / variance of each
    AL       (2 c n, m), how residuals follow the calibration's error in units of its own covariance
    """
    N = AL.T @ AL + np.eye(AL.shape[1])
    e = system.e.ravel()
    X = np.concatenate(columns, -1).reshape(e.size, -1)
    S = X.T @ X - X.T @ AL @ np.linalg.solve(N, AL.T @ X) + np.diag(prior)
    g = X.T @ e - X.T @ AL @ np.linalg.solve(N, AL.T @ e)
    x = np.linalg.solve(S, g)
    before = float(e @ e - AL.T @ e @ np.linalg.solve(N, AL.T @ e))
    left = max((before - float(g @ x)) / float(np.einsum("njj->", system.H)), 1.0)
    variance, most = np.diag(np.linalg.inv(S)), 1 / np.asarray(prior, float)
    known = (variance > 0) & (variance < most)  # else all of it is rounding, of pictures that are nearly exact
    return np.asarray(x, float), np.asarray(np.sqrt(np.where(known, variance, most) * left), float)
