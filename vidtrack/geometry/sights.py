"""A block of points as several cameras see them, and the least-squares point of each.

Every camera gives two rows in the unknown point p (thesis 4.3.8, 4.3.9; u = Xu/f, v = Yu/f):

    (r1 - u r7) x + (r2 - u r8) y + (r3 - u r9) z = u Tz - Tx
    (r4 - v r7) x + (r5 - v r8) y + (r6 - v r9) z = v Tz - Ty

and the least-squares answer is p = (A^T A)^-1 A^T B (4.3.10 - 4.3.14). These rows count a pixel of a far camera
for more than one of a near camera; refinement then minimises the weighted reprojection error in px, by
Gauss-Newton steps on the same 3x3 normal equations. The lens is linearised at the measured pixel, so that a step
needs no inverse distortion; the difference from the exact pixel error is of second order in that error.

Arrays here hold coordinates first, (3, n), and one block at a time, so that all of it stays in the processor's
cache. Positions are relative to an origin among the cameras, so that no digits are lost far from the world's origin.

Through interfaces (`geometry.bent`) the measured pixel has its exact ray in the object's medium; the linear answer is
the point nearest to the rays, and the refinement is linear about them as it is about the lens.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.bent import Bent, bent
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    undistorted_from_distorted,
    undistorted_jacobian,
)
from vidtrack.geometry.symmetric import add_product, inverse, times

Mask = NDArray[np.bool_]


class Sight(NamedTuple):
    """One camera's measurements of a block of n points."""

    R: Array  # (3, 3)
    t: Array  # (3,) camera coordinates of the block's origin
    uv: Array  # (2, n) tangents Xu/f, Yu/f; 0 where there is no measurement
    d: Array  # (2, n) Xd, Yd, unit of dx; 0 where there is no measurement
    px: Array  # (2, 2, n) d(Xf, Yf)/d(u, v)
    weight: Array  # (2, n) of Xf and Yf, 1/px^2; 0 where the camera is not used
    on: Array  # (n,) 1 where the camera is used, else 0
    seen: Mask  # (n,) whether there is a measurement at all
    bent: Bent | None = None  # the light's path, where it leads through interfaces

    @property
    def used(self) -> Mask:
        return np.asarray(self.on > 0)


class Seen(NamedTuple):
    """Located points seen from one camera."""

    error: Array  # (2, n) measured minus projected, px
    depth: Array  # (n,) world units
    off2: Array  # (n,) squared distance from the point to the line of sight


def sight(camera: Camera, b: Array, weight: Array, used: Mask, origin: Array) -> Sight:
    """What a camera measures of a block: b and weight (n, 2), px and 1/px^2; used (n,); origin (3,) in the world."""
    d = distorted_from_frame_buffer(camera, b)
    u = undistorted_from_distorted(camera, d)
    seen = np.asarray(np.isfinite(u[:, 0] + u[:, 1]))
    uv = np.ascontiguousarray(u.T)
    uv /= camera.f
    px = _px_by_tangent(camera, d)
    d = np.ascontiguousarray(d.T)
    path = None
    if camera.through:
        path = bent(camera, np.where(seen, uv, 0), origin)
        seen &= path.there
    on = (used & seen).astype(float)
    w = weight.T * on
    if not seen.all():
        uv[:, ~seen] = d[:, ~seen] = px[..., ~seen] = w[:, ~seen] = 0
    return Sight(camera.R, camera.R @ origin + camera.T, uv, d, px, w, on, seen, path)


def _px_by_tangent(camera: Camera, d: Array) -> Array:
    """d(Xf, Yf)/d(u, v), (2, 2, n) px, at distorted positions d (n, 2): the inverse of the lens's own Jacobian."""
    J = undistorted_jacobian(camera, d)
    xx, xy, yx, yy = J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        per = camera.f / (xx * yy - xy * yx)
    out = np.empty((2, 2, len(d)))
    x_scale, y_scale = camera.Sx / camera.dx, 1 / camera.dy
    np.multiply(yy, per * x_scale, out=out[0, 0])
    np.multiply(xy, per * -x_scale, out=out[0, 1])
    np.multiply(yx, per * -y_scale, out=out[1, 0])
    np.multiply(xx, per * y_scale, out=out[1, 1])
    if camera.skew:
        out[0] += out[1] * (camera.skew * camera.dy / camera.dx)
    return out


def linear_point(sights: Sequence[Sight]) -> tuple[Array, Array]:
    """Equations 4.3.8 - 4.3.13: the points (3, n) and (A^T A)^-1 (6, n)."""
    p, Q = _linear_point(sights, None)
    if any(s.bent and not s.bent.beyond(p) for s in sights):  # points that some camera sees directly
        p, Q = _linear_point(sights, p)
    return p, Q


def _linear_point(sights: Sequence[Sight], near: Array | None) -> tuple[Array, Array]:
    """near   (3, n), where the points are roughly: in which medium; None: behind all planes."""
    n = sights[0].uv.shape[1]
    N, h = np.zeros((6, n)), np.zeros((3, n))
    for s in sights:
        if s.bent:
            s.bent.add_lines(N, h, s.on, near)
            continue
        for tangent, row, shift in zip(s.uv, s.R[:2], s.t[:2], strict=True):
            a = row[:, None] - s.R[2][:, None] * tangent
            weighted = a * s.on
            add_product(N, weighted, a)
            weighted *= tangent * s.t[2] - shift
            h += weighted
    Q = inverse(N)
    return times(Q, h), Q


Rows = tuple[Array, Array]
"""By-point derivatives of Xf and of Yf, each (3, n) px per world unit."""


def refined_point(sights: Sequence[Sight], p: Array, steps: int) -> tuple[Array, Array, list[Rows]]:
    """At most `steps` of Gauss-Newton on the weighted reprojection error.

    Points (3, n), covariance (6, n), and the derivatives that each sight had at the last step.
    """
    for _ in range(steps):
        N, h = np.zeros((6, p.shape[1])), np.zeros_like(p)
        nearest = np.full(p.shape[1], np.inf)
        last = []
        for s in sights:
            rows, error, depth = _linearised(s, p)
            for g, e, w in zip(rows, error, s.weight, strict=True):
                weighted = w * g
                add_product(N, weighted, g)
                weighted *= e
                h += weighted
            np.minimum(nearest, depth, out=nearest, where=s.used)
            last.append(rows)
        Q = inverse(N)
        step = times(Q, h)
        p = p + step
        # what one step leaves, in standard deviations, is about its own size in them times its size over the depth
        left = np.sqrt(np.abs(np.einsum("in,in->n", step, h)) * np.einsum("in,in->n", step, step)) / nearest
        if not np.max(left, where=np.isfinite(left), initial=0) > 1e-3:
            break
    return p, Q, last


def _linearised(s: Sight, p: Array) -> tuple[Rows, tuple[Array, Array], Array]:
    """By-point derivatives of Xf and Yf, each (3, n) px per unit; measured minus projected px; depth (n,)."""
    if s.bent:
        (a, b), (du, dv), _ = s.bent.seen(p)
        (xu, xv), (yu, yv) = s.px
        depth = s.R[2] @ p + s.t[2]
        return (xu * a + xv * b, yu * a + yv * b), (-xu * du - xv * dv, -yu * du - yv * dv), depth
    c = s.R @ p
    c += s.t[:, None]
    near = 1 / c[2]
    u, v = c[0] * near, c[1] * near
    a = (s.R[0][:, None] - s.R[2][:, None] * u) * near
    b = (s.R[1][:, None] - s.R[2][:, None] * v) * near
    du, dv = s.uv[0] - u, s.uv[1] - v
    (xu, xv), (yu, yv) = s.px
    return (xu * a + xv * b, yu * a + yv * b), (xu * du + xv * dv, yu * du + yv * dv), c[2]


def refined_gain(s: Sight, rows: Rows, covariance: Array) -> Array:
    """How refined points follow this camera's pixels: dp/d(Xf, Yf), (2, 3, n) world units per px."""
    gain = np.empty((2, *rows[0].shape))
    for g, w, out in zip(rows, s.weight, gain, strict=True):
        np.multiply(times(covariance, g), w, out=out)
    return gain


def linear_gain(s: Sight, p: Array, Q: Array) -> Array:
    """How linear points follow this camera's pixels, (2, 3, n): a tangent's error counts as often as p is deep."""
    (xu, xv), (yu, yv) = s.px
    det = xu * yv - xv * yu
    if s.bent:
        a, b = (times(Q, moved) for moved in s.bent.across(p))
        return np.where(s.used, np.stack([yv * a - yu * b, xu * b - xv * a]) / det, 0.0)
    depth = s.R[2] @ p + s.t[2]
    a, b = (times(Q, (row[:, None] - s.R[2][:, None] * t) * depth) for row, t in zip(s.R[:2], s.uv, strict=True))
    return np.where(s.used, np.stack([yv * a - yu * b, xu * b - xv * a]) / det, 0.0)


def carried_noise(sights: Sequence[Sight], gains: Sequence[Array]) -> Array:
    """Covariance (6, n) of the points from centroid noise, carried by the gains."""
    total = np.zeros((6, gains[0].shape[-1]))
    for s, gain in zip(sights, gains, strict=True):
        for g, w in zip(gain, s.weight, strict=True):
            add_product(total, g * np.where(w > 0, 1 / w, 0.0), g)
    return total


def look_back(s: Sight, p: Array) -> Seen:
    """Where the camera sees the points p (3, n), and how far its line of sight passes from them."""
    x, y, z = s.R @ p + s.t[:, None]
    if s.bent:
        _, (du, dv), off = s.bent.seen(p)
        du, dv, off2 = -du, -dv, np.einsum("in,in->n", off, off)
    else:
        u, v = s.uv
        cross_x, cross_y = x - u * z, y - v * z
        length2 = 1 + u * u + v * v
        off2 = (cross_x**2 + cross_y**2 + (v * cross_x - u * cross_y) ** 2) / length2
        du, dv = -cross_x / z, -cross_y / z
    error = np.empty((2, z.size))
    np.add(s.px[0, 0] * du, s.px[0, 1] * dv, out=error[0])
    np.add(s.px[1, 0] * du, s.px[1, 1] * dv, out=error[1])
    return Seen(error, z, off2)
