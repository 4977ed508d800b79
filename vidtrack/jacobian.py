"""How a pixel moves when the camera or the point moves: the analytic derivatives of `camera.project`.

The camera's attitude is varied about a pivot, a world point amid the calibration points:

    c = exp(omega) R (p - pivot) + t,   t = R pivot + T

so that turning the camera does not throw points far from the world origin across the picture, and the
covariance of the parameters stays well conditioned wherever the origin lies.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.camera import (
    Array,
    Camera,
    camera_from_world,
    distorted_from_undistorted,
    undistorted_from_camera,
    undistorted_jacobian,
)

PARAMETERS = (
    *("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z"),
    *("f", "Sx", "Cx", "Cy", "kappa1", "kappa2", "p1", "p2", "skew"),
)
"""The order of a camera's parameters in every vector, Jacobian and covariance.

omega rad, about the camera axes; t world units, of the pivot in camera axes; the rest as in `Camera`.
"""


class Derivatives(NamedTuple):
    """What `derivatives` returns; the units are px per unit of what varies."""

    projected: Array  # (..., 2) px
    by_parameter: Array  # (..., 2, 15)
    by_point: Array  # (..., 2, 3)


def derivatives(camera: Camera, p: ArrayLike, pivot: ArrayLike) -> Derivatives:
    """Projected position, and its derivatives by the camera's parameters and by the world point.

    p       (..., 3)  world points, world units
    pivot   (3,)      the point about which omega turns
    NaN where the point does not project.
    The lens is given from distorted to undistorted, so its derivative is the inverse of that Jacobian:
    U(d; k) = u  gives  dd = (dU/dd)^-1 (du - dU/dk dk).
    """
    p = np.asarray(p, float)
    c = camera_from_world(camera, p)
    u = undistorted_from_camera(camera, c)
    d = distorted_from_undistorted(camera, u)
    x, y, z = c[..., 0], c[..., 1], np.where(c[..., 2] > 0, c[..., 2], np.nan)
    shape = p.shape[:-1]

    u_by_c = np.zeros((*shape, 2, 3))
    u_by_c[..., 0, 0] = u_by_c[..., 1, 1] = camera.f / z
    u_by_c[..., 0, 2] = -camera.f * x / z**2
    u_by_c[..., 1, 2] = -camera.f * y / z**2

    d_by_u = np.linalg.inv(_finite(undistorted_jacobian(camera, d)))
    b_by_d = np.array([[camera.Sx / camera.dx, camera.skew / camera.dx], [0, 1 / camera.dy]])
    b_by_u = b_by_d @ d_by_u
    b_by_c = b_by_u @ u_by_c

    arm = (p - np.asarray(pivot, float)) @ camera.R.T  # R (p - pivot)
    J = np.zeros((*shape, 2, len(PARAMETERS)))
    J[..., :, 0] = _dot(b_by_c, np.stack([0 * arm[..., 0], -arm[..., 2], arm[..., 1]], -1))
    J[..., :, 1] = _dot(b_by_c, np.stack([arm[..., 2], 0 * arm[..., 0], -arm[..., 0]], -1))
    J[..., :, 2] = _dot(b_by_c, np.stack([-arm[..., 1], arm[..., 0], 0 * arm[..., 0]], -1))
    J[..., :, 3:6] = b_by_c
    J[..., :, 6] = _dot(b_by_u, u / camera.f)
    J[..., 0, 7] = d[..., 0] / camera.dx
    J[..., 0, 8] = 1
    J[..., 1, 9] = 1

    X, Y = d[..., 0], d[..., 1]
    r2 = X * X + Y * Y
    for column, u_by_k in (
        (10, np.stack([X * r2, Y * r2], -1)),
        (11, np.stack([X * r2 * r2, Y * r2 * r2], -1)),
        (12, np.stack([r2 + 2 * X * X, 2 * X * Y], -1)),
        (13, np.stack([2 * X * Y, r2 + 2 * Y * Y], -1)),
    ):
        J[..., :, column] = -_dot(b_by_u, u_by_k)
    J[..., 0, 14] = Y / camera.dx

    projected = np.stack([(camera.Sx * X + camera.skew * Y) / camera.dx + camera.Cx, Y / camera.dy + camera.Cy], -1)
    lost = ~np.isfinite(projected).all(-1)
    J[lost] = np.nan
    by_point = b_by_c @ camera.R
    by_point[lost] = np.nan
    return Derivatives(projected, J, by_point)


def stepped(camera: Camera, pivot: ArrayLike, step: Mapping[str, float]) -> Camera:
    """The camera after small changes of named parameters (see PARAMETERS) about the pivot."""
    pivot = np.asarray(pivot, float)
    omega = np.array([step.get(f"omega_{a}", 0.0) for a in "xyz"])
    shift = np.array([step.get(f"t_{a}", 0.0) for a in "xyz"])
    R = rotation_from_vector(omega) @ camera.R
    T = camera.R @ pivot + camera.T + shift - R @ pivot
    rest = {name: getattr(camera, name) + step[name] for name in PARAMETERS[6:] if name in step}
    return camera.with_(R=R, T=T, **rest)


def rotation_from_vector(omega: ArrayLike) -> Array:
    """The rotation (3, 3) by |omega| rad about the axis omega (3,): Rodrigues' formula."""
    omega = np.asarray(omega, float)
    angle = float(np.linalg.norm(omega))
    K = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    # sinc keeps full precision for the smallest steps
    R: Array = np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)
    return R


def _dot(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., None])[..., 0]


def _finite(J: Array) -> Array:
    bad = ~np.isfinite(J).all((-2, -1)) | (np.linalg.det(np.nan_to_num(J)) == 0)
    return np.where(bad[..., None, None], np.eye(2), J)
