"""Balls as a camera sees them, by the circle in which a cone of sight touches each; what corrects is not used."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project


class Seen(NamedTuple):
    """The middles (..., 2), px, and areas (...), px^2, of outlines."""

    b: Array
    pixels: Array


def middle_and_area(polygon: Array) -> Seen:
    """Of polygons (..., n, 2)."""
    about = polygon.mean(-2, keepdims=True)
    x, y = np.moveaxis(polygon - about, -1, 0)
    xn, yn = np.roll(x, -1, -1), np.roll(y, -1, -1)
    cross = x * yn - xn * y
    area = cross.sum(-1) / 2
    middle = np.stack([((x + xn) * cross).sum(-1), ((y + yn) * cross).sum(-1)], -1) / (6 * area)[..., None]
    return Seen(middle + about[..., 0, :], np.abs(area))


def touched(c: ArrayLike, r: ArrayLike, n: int = 720) -> Array:
    """The circles (..., n, 3) in which cones from the origin touch balls at c (..., 3) of radius r (...)."""
    c = np.asarray(c, float)
    D = np.linalg.norm(c, axis=-1, keepdims=True)
    e1 = np.cross(c, [0.0, 1.0, 0.0])
    e1 /= np.linalg.norm(e1, axis=-1, keepdims=True)
    e2 = np.cross(c / D, e1)
    r = np.broadcast_to(np.asarray(r, float), D.shape[:-1])[..., None]
    turn = 2 * np.pi * np.arange(n)[:, None] / n
    ring = np.cos(turn) * e1[..., None, :] + np.sin(turn) * e2[..., None, :]
    return (c * (1 - (r / D) ** 2))[..., None, :] + (r * np.sqrt(1 - (r / D) ** 2))[..., None] * ring


def seen(camera: Camera, p: ArrayLike, radius: ArrayLike, n: int = 120) -> Seen:
    """Balls of this radius at p (..., 3), world units."""
    ring = touched(np.asarray(p, float) - camera.position, radius, n)
    return middle_and_area(project(camera, ring + camera.position))
