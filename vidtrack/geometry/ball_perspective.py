"""The perspective of a ball: how far the middle of its outline lies from the image of its own middle.

The rays that touch a ball make a cone about the line of sight to its middle, of half angle alpha, sin alpha = r / D.
The picture cuts that cone in an ellipse, whose middle lies further out than the line of sight; the lens then bends the
ellipse. In a picture without distortion, x px from the principal point and at the angle theta to the axis, the ellipse
of the area pi R^2 is off outwards by

    x sin^2 alpha / (cos^2 theta - sin^2 alpha) = x (R / f)^2 cos theta  (1 + O(alpha^2)).

What a lens adds is of the same order: of Ru = Rd (1 + kappa1 Rd^2) it is -3 kappa1 R^2 x near the axis. So both are
taken at once, from the camera itself. From the pixel b, where the middle is seen, rays leave in all directions n of
the picture. With s(rho n) the sine of the angle between the lines of sight of b + rho n and of b (through interfaces:
the distance of the line from the ball's middle), the outline is where s = sin alpha. By its values at +R and -R,
s = a rho + c rho^2 / 2,

    a = (s(+R) + s(-R)) / 2R,    c = (s(+R) - s(-R)) / R^2,    rho = sin alpha / a - c sin^2 alpha / (2 a^3) + ...

and of the area inside the curve rho(n), which is pi R^2, the middle lies at

    (1 / pi R^2) int rho^3 / 3 n dphi  =  -(sin^4 alpha / (2 pi R^2)) int c / a^5 n dphi,
    sin^2 alpha = 2 pi R^2 / int a^-2 dphi.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, line_of_sight, undistorted_from_frame_buffer

AROUND = 12
"""Directions in which the outline is looked for: with pixels twice as wide as high the error is below a hundredth."""

AT_ONCE = 20_000
"""Balls whose outlines are held in memory together."""

SHARE = 0.15
"""ASSUME: one sd of an offset, of itself. A width within 3 % is one within 6 % of R^2; a ball that a lamp beside the
camera lights, darker at its rim, has 0.8 of the offset, and looks by its light and middle as if it had 0.73."""


def outline_offset(camera: Camera, b: ArrayLike, radius: ArrayLike, distance: ArrayLike | None = None) -> Array:
    """By how much (..., 2), px, the middle of a ball's outline lies off the image of its middle b (..., 2), px.

    radius    (...) px, of the disc that has as many pixels as the outline; NaN or 0 where it is no ball: 0 then
    distance  (...) world units, from the last interface to the ball along its light; without interfaces it does not
              matter. None where it is not known: as without them
    b may be the middle of the outline as well: what that changes is by (R / f)^2 less. 0 where b is NaN, or where the
    lens folds within R of it.
    """
    b = np.asarray(b, float)
    shape = np.broadcast_shapes(b.shape[:-1], np.shape(radius))
    places = np.broadcast_to(b, (*shape, 2)).reshape(-1, 2)
    R = np.broadcast_to(np.asarray(radius, float), shape).ravel()
    far = None if distance is None else np.broadcast_to(np.asarray(distance, float), shape).ravel()
    out = np.zeros(places.shape)
    some = np.flatnonzero((R > 0) & np.isfinite(R) & np.isfinite(places).all(-1))
    for first in range(0, some.size, AT_ONCE):
        own = some[first : first + AT_ONCE]
        out[own] = _offsets(camera, places[own], R[own], None if far is None else far[own])
    return np.nan_to_num(out).reshape(*shape, 2)


def _offsets(camera: Camera, b: Array, R: Array, distance: Array | None) -> Array:
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    n = np.stack([np.cos(angle), np.sin(angle)], -1)
    s = _apart(camera, b[:, None] + R[:, None, None] * n, b, distance)
    other = np.roll(s, AROUND // 2, axis=-1)
    a = (s + other) / (2 * R[:, None])
    c = (s - other) / (R * R)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        sine2 = R * R / np.mean(a**-2, axis=-1)
        return np.asarray(-(sine2**2 / (R * R))[:, None] * ((c * a**-5) @ n) / AROUND)


def _apart(camera: Camera, ring: Array, b: Array, distance: Array | None) -> Array:
    """How far (k, AROUND) the lines of sight of pixels (k, AROUND, 2) pass by what pixels b (k, 2) see: in shares of
    its distance, which is the sine of the angle between them; through interfaces from where light leaves the last.
    """
    if not camera.through or distance is None:
        rays, middle = (_unit(undistorted_from_frame_buffer(camera, px) / camera.f) for px in (ring, b))
        return np.asarray(np.linalg.norm(np.cross(rays, middle[:, None]), axis=-1))
    start, rays = line_of_sight(camera, ring)
    origin, middle = line_of_sight(camera, b)
    rays, middle = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (rays, middle))
    to = middle[:, None] + (origin[:, None] - start) / distance[:, None, None]
    return np.asarray(np.linalg.norm(np.cross(rays, to), axis=-1))


def _unit(u: Array) -> Array:
    """Directions (..., 3) of undistorted coordinates over f, (..., 2)."""
    rays = np.concatenate([u, np.ones((*u.shape[:-1], 1))], -1)
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))
