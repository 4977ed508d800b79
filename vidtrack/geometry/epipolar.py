"""How far, in px, what one camera sees lies from the line along which another camera must see it.

A line of sight of camera a, seen by camera b, is the epipolar line (thesis 4.3, figure 4.10); through a lens that
distorts it is a curve. With tangents u = (Xu/f, Yu/f, 1) of both cameras and their relative pose c_b = R c_a + t

    u_b . (t x R u_a) = 0,        E = [t]x R  (Longuet-Higgins 1981)

and the left side, divided by its gradient by the pixel (Xf, Yf) of camera b, is the distance from the curve to
first order: within 1 % of the exact one for a px or two. Its sign is that of the side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    undistorted_from_distorted,
    undistorted_jacobian,
)


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
    The sign is that of u_b . E u_a: for cameras side by side (b right of a) positive is below the curve.
    """
    line = _tangents(a, seen_by_a) @ essential(a, b).T
    u, gradient_u, gradient_v = _with_gradient(b, seen_by_b)
    value = np.sum(u * line, -1)
    # d(u, v)/d(Xf, Yf) carries the gradient from tangents to pixels
    steep = [np.sum(g * line[..., :2], -1) for g in (gradient_u, gradient_v)]
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
