"""A first pose of a square from where one camera sees its corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, undistorted_from_frame_buffer


def planar_start(camera: Camera, b: Array, square: Array) -> tuple[Array, Array]:
    """A first pose of a square from its four corners, b (T, 4, 2) px: of the plane's homography (Zhang 2000).

    square   (4, 3) the corners in the body's axes, in one plane
    Returns origin (T, 3) and R (T, 3, 3) in the world; NaN where a corner is not seen. Interfaces are left out:
    the fit that follows has them.
    """
    middle = square.mean(0)
    ex = square[1] - square[0]
    ex = ex / np.linalg.norm(ex)
    ez = np.cross(ex, square[2] - square[1])
    ez = ez / np.linalg.norm(ez)
    E = np.stack([ex, np.cross(ez, ex), ez])  # plane axes by rows
    flat = ((square - middle) @ E.T)[:, :2]
    m = undistorted_from_frame_buffer(camera, b) / camera.f
    good: NDArray[np.bool_] = np.asarray(np.isfinite(m).all((-1, -2)))
    T = len(b)
    A = np.zeros((T, 8, 8))
    x, y = flat.T
    u, v = np.where(good[:, None, None], m, flat)[..., 0], np.where(good[:, None, None], m, flat)[..., 1]
    A[:, 0::2, 0], A[:, 0::2, 1], A[:, 0::2, 2] = x, y, 1
    A[:, 1::2, 3], A[:, 1::2, 4], A[:, 1::2, 5] = x, y, 1
    A[:, 0::2, 6], A[:, 0::2, 7] = -u * x, -u * y
    A[:, 1::2, 6], A[:, 1::2, 7] = -v * x, -v * y
    rhs = np.stack([u, v], -1).reshape(T, 8)
    good &= np.linalg.cond(A) < 1e12
    h = np.linalg.solve(np.where(good[:, None, None], A, np.eye(8)), rhs[..., None])[..., 0]
    H = np.concatenate([h, np.ones((T, 1))], -1).reshape(T, 3, 3)
    scale = np.sqrt(np.linalg.norm(H[..., 0], axis=-1) * np.linalg.norm(H[..., 1], axis=-1))
    H = H / scale[:, None, None]
    M = np.stack([H[..., 0], H[..., 1], np.cross(H[..., 0], H[..., 1])], -1)
    U, _, Vt = np.linalg.svd(np.where(np.isfinite(M), M, np.eye(3)))
    turn = U @ Vt
    turn = turn * np.sign(np.linalg.det(turn))[:, None, None]
    R = camera.R.T @ turn @ E
    centre = (H[..., 2] - camera.T) @ camera.R
    origin = centre - R @ middle
    good &= np.isfinite(origin).all(-1)
    return np.where(good[:, None], origin, np.nan), np.where(good[:, None, None], R, np.nan)
