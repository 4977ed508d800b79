"""How far, in px, what one camera sees lies from the line along which another camera must see it.

A line of sight of camera a, seen by camera b, is the epipolar line (thesis 4.3, figure 4.10); through a lens that
distorts it is a curve. With tangents u = (Xu/f, Yu/f, 1) of both cameras and their relative pose c_b = R c_a + t

    u_b . (t x R u_a) = 0,        E = [t]x R  (Longuet-Higgins 1981)

and the left side, divided by its gradient by the pixel (Xf, Yf) of camera b, is the distance from the curve to
first order: within 1 % of the exact one for a px or two. Its sign is that of the side.

Through interfaces the lines are those in the object's medium, which share no centre: in Pluecker's coordinates
L = (d, q x d) two lines meet where d_a . (q_b x d_b) + d_b . (q_a x d_a) = 0, and without interfaces that is the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    undistorted_from_distorted,
    undistorted_jacobian,
)
from vidtrack.geometry.interface import planes_of
from vidtrack.geometry.refracted import pencil
from vidtrack.geometry.refraction import traced

MEET = np.roll(np.eye(6), 3, axis=1)
"""L_b . MEET L_a is 0 for lines in Pluecker's coordinates that meet."""


def about(cameras: Sequence[Camera]) -> tuple[Array, float] | None:
    """Origin (3,) and scale, world units, for lines of sight of these cameras; None where no interface is."""
    if not any(camera.through for camera in cameras):
        return None
    places = np.array([camera.position for camera in cameras])
    origin = places.mean(0)
    near = [np.linalg.norm(interface.point - origin) for camera in cameras for interface in camera.through]
    return origin, float(max(np.abs(places - origin).max(), *near)) or 1.0


def lines(camera: Camera, b: ArrayLike, written: tuple[Array, float] | None) -> tuple[Array, Array, Array]:
    """Lines of sight of frame buffer positions (..., 2) px, with their derivatives by Xf and by Yf, 1/px.

    written   None: tangents (..., 3) and derivatives (..., 2) of (u, v); else (origin, scale): Pluecker's coordinates
              (..., 6) of the line in the object's medium, lengths relative to the origin and in units of the scale
    """
    u, by_x, by_y = _with_gradient(camera, b)
    if written is None:
        return u, by_x, by_y
    origin, scale = written
    flat = u.reshape(-1, 3).T[:2]
    planes = [plane._replace(point=plane.point - origin) for plane in planes_of(camera.through, camera.position)]
    rays = traced(planes, pencil(camera, flat, camera.position - origin))[-1]
    q, dq = rays.q / scale, rays.dq / scale
    line = np.concatenate([rays.d, np.cross(q, rays.d, axis=0)])
    moved = np.concatenate([rays.dd, np.cross(dq, rays.d[None], axis=1) + np.cross(q[None], rays.dd, axis=1)], 1)
    by = np.moveaxis(moved, -1, 0).reshape(*u.shape[:-1], 2, 6)
    by_x, by_y = ((g[..., None, :] @ by)[..., 0, :] for g in (by_x, by_y))
    return np.moveaxis(line, -1, 0).reshape(*u.shape[:-1], 6), by_x, by_y


def essential(a: Camera, b: Camera) -> Array:
    """E (3, 3), world units: u_b . E u_a = 0 for what both cameras see. All zero where they share a centre."""
    R = b.R @ a.R.T
    t = b.R @ (a.position - b.position)
    return np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]]) @ R


def epipolar_distance(a: Camera, b: Camera, seen_by_a: ArrayLike, seen_by_b: ArrayLike) -> Array:
    """Signed distance, px (...), of what b sees from the epipolar curve of what a sees.

    seen_by_a, seen_by_b   (..., 2)  frame buffer px at the same moment; leading axes broadcast, so that
                           (n, 1, T, 2) and (m, T, 2) give the distances (n, m, T) of all pairs of tracks
    NaN where either is NaN. Noise of s px in every coordinate makes the distance vary by about 1.4 s.
    Through interfaces: from the curve of what a sees in the object's medium; at a bare surface from the nearer of the
    curves in both media. The sign is that of u_b . E u_a:
    for cameras side by side (b right of a) positive is below the curve.
    """
    distance = _distance(a, b, seen_by_a, seen_by_b, about((a, b)))
    if above := above_surface((a, b)):
        dry = _distance(above[0], above[1], seen_by_a, seen_by_b, None)
        distance = np.where(np.abs(dry) < np.abs(distance), dry, distance)
    return distance


def above_surface(cameras: Sequence[Camera]) -> tuple[Camera, ...] | None:
    """The cameras as they see what lies on their own side of a bare surface; None where none looks at one.

    Targets may be above water and in it, but not between a camera and its window.
    """
    if not any(not interface.thickness for camera in cameras for interface in camera.through):
        return None
    return tuple(camera.with_(through=()) for camera in cameras)


def _distance(
    a: Camera, b: Camera, seen_by_a: ArrayLike, seen_by_b: ArrayLike, written: tuple[Array, float] | None
) -> Array:
    E = essential(a, b) if written is None else MEET
    seen = _tangents(a, seen_by_a) if written is None else lines(a, seen_by_a, written)[0]
    line = seen @ E.T
    u, gradient_u, gradient_v = lines(b, seen_by_b, written)
    value = np.sum(u * line, -1)
    # d(u, v)/d(Xf, Yf) carries the gradient from tangents to pixels
    steep = [np.sum(g * line[..., : g.shape[-1]], -1) for g in (gradient_u, gradient_v)]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = value / np.hypot(*steep)
    return np.where(np.isfinite(distance), distance, np.nan)


def _tangents(camera: Camera, b: ArrayLike) -> Array:
    u = undistorted_from_distorted(camera, distorted_from_frame_buffer(camera, b)) / camera.f
    return np.concatenate([u, np.ones((*u.shape[:-1], 1))], -1)


def _with_gradient(camera: Camera, b: ArrayLike) -> tuple[Array, Array, Array]:
    """Tangents (..., 3), and the derivatives (..., 2) of (u, v) by Xf and by Yf, 1/px."""
    d = distorted_from_frame_buffer(camera, b)
    u = undistorted_from_distorted(camera, d) / camera.f
    J = undistorted_jacobian(camera, d) / camera.f
    by_x = J[..., 0] * (camera.dx / camera.Sx)
    by_y = J[..., 1] * camera.dy - J[..., 0] * (camera.skew * camera.dy / camera.Sx)
    return np.concatenate([u, np.ones((*u.shape[:-1], 1))], -1), by_x, by_y
