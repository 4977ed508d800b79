"""A line up a beach or structure, as one camera sees it: where its points lie in the world and in the picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, contains, project

LEAST_SAMPLES = 20


class Transect(NamedTuple):
    """n points from the seaward to the landward end.

    s   (n,)    world units, distance along the ground from the seaward end
    p   (n, 3)  world units
    b   (n, 2)  px, where the camera sees them
    """

    s: Array
    p: Array
    b: Array


def transect(
    camera: Camera, start: ArrayLike, end: ArrayLike, *, step: float | None = None, profile: ArrayLike | None = None
) -> Transect:
    """Points along a transect, evenly spaced: by `step` on the ground, or else by about one px in the picture.

    start, end   (3,)    world units, seaward and landward end; between them the ground is straight (a plane beach) ...
    profile      (k, 3)  ... or follows these surveyed points, in any order, from end to end
    step         world units
    The part that the picture does not hold is left out.
    Raises ValueError when fewer than 20 points remain, or the profile does not reach from start to end.
    """
    ground = _ground(np.asarray(start, float), np.asarray(end, float), profile)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ground, axis=0), axis=1))])
    if not length[-1] > 0:
        raise ValueError("its two ends are the same point")
    fine = np.linspace(0, length[-1], 4001)
    seen = _seen(camera, _at(ground, length, fine))
    if not seen.any():
        raise ValueError("the camera does not see any of it")
    low, high = fine[seen][[0, -1]]
    if step is not None:
        s = np.arange(low, high + 1e-9 * step, step)
    else:
        pixels = project(camera, _at(ground, length, fine[seen]))
        path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(pixels, axis=0), axis=1))])
        s = np.interp(np.linspace(0, path[-1], int(np.ceil(path[-1])) + 1), path, fine[seen])
    p = _at(ground, length, s)
    b = project(camera, p)
    if len(s) < LEAST_SAMPLES or not contains(camera, b).all():
        raise ValueError(f"the camera sees only {len(s)} samples of it in one piece; {LEAST_SAMPLES} are needed")
    return Transect(s, p, b)


def _ground(start: Array, end: Array, profile: ArrayLike | None) -> Array:
    if profile is None:
        return np.stack([start, end])
    points: Array = np.asarray(profile, float)
    way = (end - start) * [1, 1, 0] if np.hypot(*(end - start)[:2]) > 1e-9 else end - start
    along = (points - start) @ way / (way @ way)
    order = np.argsort(along)
    along, points = along[order], points[order]
    if along[0] > 1e-6 or along[-1] < 1 - 1e-6:
        raise ValueError(
            f"its profile covers {100 * along[0]:.0f} to {100 * along[-1]:.0f} % of the way, not all of it"
        )
    inside = (along > 0) & (along < 1)
    ends = np.stack([np.interp([0, 1], along, column) for column in points.T], -1)
    return np.concatenate([ends[:1], points[inside], ends[1:]])


def _at(ground: Array, length: Array, s: Array) -> Array:
    return np.stack([np.interp(s, length, column) for column in ground.T], -1)


def _seen(camera: Camera, p: Array) -> NDArray[np.bool_]:
    """The longest unbroken stretch of points that lie inside the picture, two px from its border."""
    inside = np.asarray(contains(camera, project(camera, p), margin=2))
    label = np.cumsum(np.concatenate([[0], np.diff(inside.astype(int)) != 0]))
    counts = np.bincount(label[inside]) if inside.any() else np.array([0])
    return np.asarray(inside & (label == int(np.argmax(counts))))


def sampling_map(line: Transect, across: int = 3) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where to read the picture: maps (n, across) of Xf and Yf for `cv2.remap`, 1 px apart across the transect."""
    along = np.gradient(line.b, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.stack([-along[:, 1], along[:, 0]], -1)
    offset = np.arange(across) - (across - 1) / 2
    where = line.b[:, None, :] + offset[:, None] * normal[:, None, :]
    return where[..., 0].astype(np.float32), where[..., 1].astype(np.float32)


def along_transect_sd(line: Transect, b_covariance: ArrayLike) -> Array:
    """Standard deviation (n,), world units, of s for errors of the projection b with covariance (n, 2, 2) px^2.

    A shift of the picture across the transect's image moves nothing along it: ds = (db/ds . db) / |db/ds|^2.
    """
    tangent = np.gradient(line.b, line.s, axis=0)
    C: Array = np.asarray(b_covariance, float)
    size = (tangent**2).sum(-1)
    return np.asarray(np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", tangent, C, tangent), 0.0)) / size)
