"""How large the balls of a run are, by all cameras, and how large each of them looks at each moment.

A sample that shows two balls in one, or a part of one, or that was fitted with what is known of it from other moments,
says little of how large the ball looks just then. A ball of diameter D at p looks D sqrt(det J) wide, J = d(px)/dp
across the line of sight (2 x 2): one D a ball, the median over its samples, serves all samples of all cameras. What was
taken off for the perspective, by the radius R that a sample shows, is as R^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.ball_perspective import SHARE
from vidtrack.geometry.camera import Camera, project

SAMPLES = 400
"""Samples of a ball in a camera, at most, by which its diameter is estimated."""

SMALL_PX = 0.01
"""Largest offset of a camera's view of a ball up to which it stays as its own samples say: the time is not worth it."""

LEAST = 0.01
"""Of the sd of a sample, at least, that is its own noise."""


class Resized(NamedTuple):
    """Sights (n_cameras, m, M, 2), px: b; sd, what changes from sample to sample; lasting, the sd of what does not."""

    b: Array
    sd: Array
    lasting: Array


def diameters(cameras: Sequence[Camera], p: Array, radius: Array) -> Array:
    """The diameters (m,), world units, of balls at p (m, M, 3) whose radius (n_cameras, m, M), px, cameras see.

    The median over the cameras, of which each gives its own median; NaN where none sees a ball.
    """
    each = np.full((len(cameras), len(p)), np.nan)
    for i, k in np.ndindex(each.shape):
        some = np.flatnonzero(np.isfinite(radius[i, k]) & np.isfinite(p[k, :, 0]))
        if some.size:
            some = some[:: -(-some.size // SAMPLES)]
            each[i, k] = np.nanmedian(2 * radius[i, k, some] / px_across(cameras[i], p[k, some]))
    known = np.isfinite(each).any(axis=0)
    out = np.full(len(p), np.nan)
    out[known] = np.nanmedian(each[:, known], axis=0)
    return out


def px_across(camera: Camera, p: Array) -> Array:
    """By how many px (...) a ball of diameter 1 at p (..., 3) looks wide."""
    sight = p - camera.position
    far = np.linalg.norm(sight, axis=-1, keepdims=True)
    along = sight / far
    right = np.cross(along, np.eye(3)[np.argmin(np.abs(camera.R[2]))])
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    step = 1e-4 * far
    b, u, v = (project(camera, p + step * way) for way in (0 * along, right, np.cross(along, right)))
    (ux, uy), (vx, vy) = (np.moveaxis((own - b) / step, -1, 0) for own in (u, v))
    return np.asarray(np.sqrt(np.abs(ux * vy - uy * vx)))


def resized(cameras: Sequence[Camera], b: Array, sd: Array, ball: Array | None, p: Array) -> Resized:
    """Sights of balls with what their diameters say of their perspective.

    b, sd  (n_cameras, m, M, 2) px, with what was taken off and its sd; ball (n_cameras, m, M, 3) as `View.ball`
    p      (m, M, 3), where the balls are; where they are NaN it stays what was taken off
    """
    if ball is None:
        return Resized(b, sd, np.zeros(sd.shape))
    off, radius = np.nan_to_num(ball[..., :2]), ball[..., 2]
    D = diameters(cameras, p, radius)
    more = np.ones(radius.shape)
    for i, k in np.ndindex(radius.shape[:2]):
        some = np.flatnonzero(np.isfinite(radius[i, k]) & np.isfinite(p[k, :, 0]))
        if some.size and np.isfinite(D[k]) and np.abs(off[i, k]).max() > SMALL_PX:
            more[i, k, some] = (D[k] / 2 * px_across(cameras[i], p[k, some]) / radius[i, k, some]) ** 2
    more = np.nan_to_num(more, nan=1.0)[..., None]
    own = np.sqrt(np.maximum(sd**2 - (SHARE * off) ** 2, (LEAST * sd) ** 2))
    return Resized(b + off * (1 - more), own, SHARE * np.abs(off) * more)
