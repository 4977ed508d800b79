"""How a pixel moves when the camera or the point moves: the analytic derivatives of `camera.project`.

The camera's attitude is varied about a pivot, a world point among the calibration points:

    c = exp(omega) R (p - pivot) + t,   t = R pivot + T

so that turning the camera does not throw points far from the world origin across the picture, and the
covariance of the parameters stays well conditioned wherever the origin lies.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    distorted_from_undistorted,
    straightened,
    undistorted_from_camera,
    undistorted_jacobian,
)
from vidtrack.geometry.interface import parameters_of
from vidtrack.geometry.lens_terms import COEFFICIENTS, TERMS
from vidtrack.geometry.projection import perspective_by_f, perspective_jacobian
from vidtrack.geometry.refracted import POSE, followed, pose_moves
from vidtrack.geometry.rotation import rotation_from_vector

PARAMETERS = (
    *POSE,
    *("f", "Sx", "Cx", "Cy"),
    *COEFFICIENTS,
)
"""The order of a camera's parameters in every vector, Jacobian and covariance.

omega rad, about the camera axes; t world units, of the pivot in camera axes; the rest as in `Camera`. Behind them come
those of the interfaces through which a camera sees (see `Interface.parameters`).
"""


def parameters(camera: Camera) -> tuple[str, ...]:
    """All parameters of a camera and of its interfaces: the columns of its derivatives."""
    return PARAMETERS + parameters_of(camera.through) if camera.through else PARAMETERS


def columns(camera: Camera, names: Sequence[str]) -> list[int]:
    """Where named parameters stand in the derivatives; a camera that does not have one raises ValueError."""
    every = parameters(camera)
    return [every.index(name) for name in names]


class Derivatives(NamedTuple):
    """What `derivatives` returns; the units are px per unit of what varies."""

    projected: Array  # (..., 2) px
    by_parameter: Array  # (..., 2, k), k = len(parameters(camera))
    by_point: Array  # (..., 2, 3)


def derivatives(camera: Camera, p: ArrayLike, pivot: ArrayLike, lens: Collection[str] = COEFFICIENTS) -> Derivatives:
    """Projected position, and its derivatives by the camera's parameters and by the world point.

    p       (..., 3)  world points, world units
    pivot   (3,)      the point about which omega turns
    lens    the coefficients whose columns are wanted; those of the others stay 0
    NaN where the point does not project.
    The lens is given from distorted to undistorted, so its derivative is the inverse of that Jacobian:
    U(d; k) = u  gives  dd = (dU/dd)^-1 (du - dU/dk dk).
    """
    p = np.asarray(p, float)
    c = camera_from_world(camera, p)
    d = distorted_from_undistorted(camera, undistorted_from_camera(camera, c))
    X, Y = d[..., 0], d[..., 1]
    z = np.where(c[..., 2] > 0, c[..., 2], np.nan)
    u, v = camera.f * c[..., 0] / z, camera.f * c[..., 1] / z

    bend = undistorted_jacobian(camera, d)
    xx, xy, yx, yy = bend[..., 0, 0], bend[..., 0, 1], bend[..., 1, 0], bend[..., 1, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        per = 1 / (xx * yy - xy * yx)

    def px(du: Array, dv: Array) -> tuple[Array, Array]:
        """What a small change of (Xu, Yu) does to (Xf, Yf)."""
        dX, dY = (yy * du - xy * dv) * per, (xx * dv - yx * du) * per
        return (camera.Sx * dX + camera.skew * dY) / camera.dx, dY / camera.dy

    g = camera.f / z
    by_c = np.empty((*p.shape[:-1], 2, 3))
    by_c[..., 0, 0], by_c[..., 1, 0] = px(g, 0 * g)
    by_c[..., 0, 1], by_c[..., 1, 1] = px(0 * g, g)
    by_c[..., 0, 2], by_c[..., 1, 2] = px(-u / z, -v / z)

    arm = ((p - np.asarray(pivot, float)) @ camera.R.T)[..., None, :]  # R (p - pivot)
    J = np.zeros((*p.shape[:-1], 2, len(parameters(camera))))
    J[..., 0] = by_c[..., 2] * arm[..., 1] - by_c[..., 1] * arm[..., 2]
    J[..., 1] = by_c[..., 0] * arm[..., 2] - by_c[..., 2] * arm[..., 0]
    J[..., 2] = by_c[..., 1] * arm[..., 0] - by_c[..., 0] * arm[..., 1]
    J[..., 3:6] = by_c
    by_f = np.stack([u, v], -1) / camera.f
    wide = camera.projection == "equidistant"
    if wide:
        e = straightened(camera, d)
        by_f = by_f - perspective_by_f(e, camera.f)
        onwards = perspective_jacobian(e, camera.f)
    J[..., 0, 6], J[..., 1, 6] = px(by_f[..., 0], by_f[..., 1])
    J[..., 0, 7] = X / camera.dx
    J[..., 0, 8] = 1
    J[..., 1, 9] = 1
    r2 = X * X + Y * Y
    for name, term in TERMS.items():
        if name not in lens:
            continue
        shift = term.shift(X, Y, r2)
        if wide:
            moved = (onwards @ np.stack(shift, -1)[..., None])[..., 0]
            shift = moved[..., 0], moved[..., 1]
        dX, dY = px(*shift)
        column = PARAMETERS.index(name)
        J[..., 0, column], J[..., 1, column] = -dX, -dY
    if "skew" in lens:
        J[..., 0, PARAMETERS.index("skew")] = Y / camera.dx

    projected = np.stack([(camera.Sx * X + camera.skew * Y) / camera.dx + camera.Cx, Y / camera.dy + camera.Cy], -1)
    by_point = by_c @ camera.R
    if camera.through:
        by_tangent = by_c[..., :2] * z[..., None, None]
        light = followed(camera, p, c)
        by_point = by_tangent @ light.by_point
        turned = camera.R @ np.asarray(pivot, float) + camera.T
        J[..., :6] = by_tangent @ pose_moves(c[..., :2] / c[..., 2:], light.by_centre @ camera.R.T, turned)
        J[..., len(PARAMETERS) :] = by_tangent @ light.by_interface
    lost = ~np.isfinite(projected).all(-1)
    J[lost] = np.nan
    by_point[lost] = np.nan
    return Derivatives(projected, J, by_point)


def stepped(camera: Camera, pivot: ArrayLike, step: Mapping[str, float]) -> Camera:
    """The camera after small changes of named parameters (see PARAMETERS) about the pivot."""
    pivot = np.asarray(pivot, float)
    omega = np.array([step.get(f"omega_{a}", 0.0) for a in "xyz"])
    shift = np.array([step.get(f"t_{a}", 0.0) for a in "xyz"])
    R = rotation_from_vector(omega) @ camera.R
    T = camera.R @ pivot + camera.T + shift - R @ pivot
    rest: dict[str, object] = {name: getattr(camera, name) + step[name] for name in PARAMETERS[6:] if name in step}
    if camera.through:
        rest["through"] = tuple(interface.stepped(step) for interface in camera.through)
    return camera.with_(R=R, T=T, **rest)


def position_covariance(camera: Camera, names: Sequence[str], pivot: ArrayLike, covariance: ArrayLike) -> Array:
    """Covariance (3, 3), world units^2, of the perspective centre, of that of the parameters `names` about the pivot.

    The centre is pivot - R^T exp(-omega) t, so it moves by R^T (omega x t - dt); f and the lens do not move it.
    """
    t = camera.R @ np.asarray(pivot, float) + camera.T
    moved = {f"t_{axis}": -np.eye(3)[k] for k, axis in enumerate("xyz")}
    moved |= {f"omega_{axis}": np.cross(np.eye(3)[k], t) for k, axis in enumerate("xyz")}
    J = camera.R.T @ np.stack([moved.get(name, np.zeros(3)) for name in names], -1)
    by_position: Array = J @ np.asarray(covariance, float) @ J.T
    return by_position
