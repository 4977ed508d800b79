"""Six degrees of freedom of a rigid body from three or more targets on it.

    located target = origin + R (target in the body)

R turns body axes into world axes. The weighted least-squares rotation comes in closed form by singular values
(Kabsch 1976; Horn 1987); Gauss-Newton steps with each target's full covariance then make the pose the most likely one,
and the same normal equations say how sure it is: a target far from the point that is reported turns its own
noise into little angle, and angle into much position (lever arm).

Angles: yaw about z, then pitch about the new y', then roll about the newest x'' (intrinsic z-y'-x''):
R = Rz(yaw) Ry(pitch) Rx(roll). Quaternion (w, x, y, z) of the same R, its sign kept from sample to sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.rotation import rotation_from_vector

NEAR_LINE = 0.02
"""ASSUME: targets whose spread across their line is less than this share of that along it fix no turn about it."""


class Pose(NamedTuple):
    """Where a body is, at every time; NaN where fewer than three targets were seen or they lie on one line.

    origin      (..., 3)     world units, the body's origin
    R           (..., 3, 3)  body axes to world axes
    covariance  (..., 6, 6)  of small turns about the world axes (rad) and of the origin (world units)
    rms         (...)        world units, distance of the located targets from where the pose puts them
    excess      (...)        misfit over what the noise explains (reduced chi squared); NaN without sigma
    n_targets   (...)        targets that the pose rests on
    collinear   (...)        three or more targets were seen, but on one line
    """

    origin: Array
    R: Array
    covariance: Array
    rms: Array
    excess: Array
    n_targets: NDArray[np.intp]
    collinear: NDArray[np.bool_]


def fit_pose(located: ArrayLike, body: ArrayLike, sigma: ArrayLike | None = None) -> Pose:
    """The pose at every time at once.

    located  (..., n, 3)  world units; a target that was not seen is NaN
    body     (n, 3)       world units, the same targets in the body's own axes, from the point to be reported
    sigma    (..., n, 3) standard deviations or (..., n, 3, 3) covariances, or None: all alike, and the size is
             taken from the misfit where more than three targets allow it, else unknown (covariance NaN)
    Raises ValueError for shapes that differ or a body of fewer than three targets or on one line.
    Check in the head: targets moved by (1, 2, 3) and not turned give origin (1, 2, 3), R = 1.
    """
    p: Array = np.asarray(located, float)
    a: Array = np.asarray(body, float)
    if a.ndim != 2 or a.shape[1] != 3 or p.shape[-2:] != a.shape:
        raise ValueError(f"located (..., n, 3) and body (n, 3) must agree, not {p.shape} and {a.shape}")
    if len(a) < 3 or not _spread(a, np.ones(len(a))) > NEAR_LINE:
        raise ValueError("a body needs three targets that do not lie on one line")
    precision = _precision(p, sigma)
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(p).all(-1) & np.isfinite(precision).all((-1, -2)))
    precision = np.where(seen[..., None, None], precision, 0.0)
    p = np.where(seen[..., None], p, 0.0)
    count = seen.sum(-1)
    weight = np.trace(precision, axis1=-2, axis2=-1)
    collinear = (count >= 3) & ~(_spread(a, seen) > NEAR_LINE)
    good = (count >= 3) & ~collinear
    R, origin = _kabsch(p, a, weight)
    for _ in range(3):
        normal, gradient = _normal(p, a, R, origin, precision)
        normal = np.where(good[..., None, None], normal, np.eye(6))
        step = np.linalg.solve(normal, gradient[..., None])[..., 0]
        R = rotation_from_vector(step[..., :3]) @ R
        origin = origin + step[..., 3:]
    covariance = np.linalg.inv(normal)
    miss = np.where(seen[..., None], p - origin[..., None, :] - _turned(R, a), 0.0)
    spare = 3 * count - 6
    misfit = np.einsum("...ni,...nij,...nj->...", miss, precision, miss)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = np.where(spare > 0, misfit / spare, np.nan)
        rms = np.sqrt((miss**2).sum((-1, -2)) / count)
    if sigma is None:
        typical = np.nanmedian(np.where(good, excess, np.nan)) if good.any() else np.nan
        covariance, excess = covariance * typical, np.full(excess.shape, np.nan)
    one, two = good[..., None], good[..., None, None]
    return Pose(
        np.where(one, origin, np.nan),
        np.where(two, R, np.nan),
        np.where(two, covariance, np.nan),
        np.where(good, rms, np.nan),
        np.where(good, excess, np.nan),
        count,
        collinear,
    )


def _precision(p: Array, sigma: ArrayLike | None) -> Array:
    if sigma is None:
        return np.broadcast_to(np.eye(3), (*p.shape, 3))
    s: Array = np.asarray(sigma, float)
    if s.shape == p.shape:
        with np.errstate(divide="ignore"):
            return np.eye(3) / s[..., None] ** 2
    if s.shape != (*p.shape, 3):
        raise ValueError(f"sigma must be {p.shape} or {(*p.shape, 3)}, not {s.shape}")
    whole: NDArray[np.bool_] = np.asarray(np.isfinite(s).all((-1, -2)))
    precision: Array = np.linalg.inv(np.where(whole[..., None, None], s, np.eye(3)))
    return np.where(whole[..., None, None], precision, np.nan)


def _spread(a: Array, seen: ArrayLike) -> Array:
    """Second over first singular value of the seen targets (..., ) about their mean."""
    w = np.asarray(seen, float)[..., None]
    mean = (w * a).sum(-2, keepdims=True) / np.maximum(w.sum(-2, keepdims=True), 1)
    s = np.linalg.svd(w * (a - mean), compute_uv=False)
    return np.asarray(s[..., 1] / np.maximum(s[..., 0], 1e-300))


def _kabsch(p: Array, a: Array, weight: Array) -> tuple[Array, Array]:
    w = weight[..., None] / np.maximum(weight.sum(-1)[..., None, None], 1e-300)
    p0, a0 = (w * p).sum(-2), (w * a).sum(-2)
    H = np.swapaxes(w * (p - p0[..., None, :]), -1, -2) @ (a - a0[..., None, :])
    U, _, Vt = np.linalg.svd(H)
    proper = np.ones(U.shape[:-1])
    proper[..., 2] = np.sign(np.linalg.det(U) * np.linalg.det(Vt))  # a rotation, never a mirror image
    R = (U * proper[..., None, :]) @ Vt
    return R, p0 - (R @ a0[..., None])[..., 0]


def _turned(R: Array, a: Array) -> Array:
    return a @ np.swapaxes(R, -1, -2)


def _normal(p: Array, a: Array, R: Array, origin: Array, precision: Array) -> tuple[Array, Array]:
    """Normal equations (..., 6, 6) and (..., 6) of a small turn and a shift."""
    arm = _turned(R, a)
    J = np.zeros((*arm.shape, 6))
    x, y, z = arm[..., 0], arm[..., 1], arm[..., 2]
    J[..., 0, 1], J[..., 0, 2] = z, -y
    J[..., 1, 0], J[..., 1, 2] = -z, x
    J[..., 2, 0], J[..., 2, 1] = y, -x
    J[..., [0, 1, 2], [3, 4, 5]] = 1
    miss = p - origin[..., None, :] - arm
    weighted = np.swapaxes(J, -1, -2) @ precision
    return (weighted @ J).sum(-3), (weighted @ miss[..., None])[..., 0].sum(-2)


def roll_pitch_yaw(R: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3), rad, of R = Rz(yaw) Ry(pitch) Rx(roll); pitch within +-pi/2, the others +-pi."""
    r: Array = np.asarray(R, float)
    roll = np.arctan2(r[..., 2, 1], r[..., 2, 2])
    pitch = np.arctan2(-r[..., 2, 0], np.hypot(r[..., 2, 1], r[..., 2, 2]))
    return np.stack([roll, pitch, np.arctan2(r[..., 1, 0], r[..., 0, 0])], -1)


def rotation_from_roll_pitch_yaw(angles: ArrayLike) -> Array:
    """R (..., 3, 3) of roll, pitch, yaw (..., 3), rad; see `roll_pitch_yaw`."""
    a: Array = np.asarray(angles, float)
    axes = np.eye(3)
    x, y, z = (rotation_from_vector(a[..., k, None] * axes[k]) for k in range(3))
    return z @ y @ x


def angles_by_turn(angles: ArrayLike) -> Array:
    """d(roll, pitch, yaw)/d(turn about the world axes), (..., 3, 3); without bound as pitch nears +-pi/2."""
    a: Array = np.asarray(angles, float)
    pitch, yaw = a[..., 1], a[..., 2]
    c, s, zero = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    cp, tp = np.cos(pitch), np.tan(pitch)
    rows = [[c / cp, s / cp, zero], [-s, c, zero], [c * tp, s * tp, zero + 1]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def unwrapped(angles: ArrayLike) -> Array:
    """Angles over time (n, ...), rad, without jumps of a whole turn; NaN stays, and the next follows the last known."""
    a: Array = np.asarray(angles, float)
    flat = a.reshape(len(a), -1).copy()
    for column in flat.T:
        good = np.isfinite(column)
        column[good] = np.unwrap(column[good])
    return flat.reshape(a.shape)


def quaternion(R: ArrayLike) -> Array:
    """Unit quaternions (n, 4) w, x, y, z of rotations over time (n, 3, 3): w >= 0 at first, then each near the last."""
    from scipy.spatial.transform import Rotation

    r: Array = np.asarray(R, float)
    q = np.full((len(r), 4), np.nan)
    good = np.flatnonzero(np.isfinite(r).all((-1, -2)))
    if not len(good):
        return q
    known: Array = Rotation.from_matrix(r[good]).as_quat(canonical=True)[:, [3, 0, 1, 2]]
    turns = np.where((known[1:] * known[:-1]).sum(-1) < 0, -1.0, 1.0)
    q[good] = known * np.cumprod(np.concatenate([[1.0], turns]))[:, None]
    return q


def rotation_from_quaternion(q: ArrayLike) -> Array:
    """R (n, 3, 3) of unit quaternions (n, 4) w, x, y, z; NaN where one is missing."""
    from scipy.spatial.transform import Rotation

    given: Array = np.asarray(q, float)
    R = np.full((len(given), 3, 3), np.nan)
    good = np.isfinite(given).all(-1)
    if good.any():
        R[good] = Rotation.from_quat(given[good][:, [1, 2, 3, 0]]).as_matrix()
    return R
