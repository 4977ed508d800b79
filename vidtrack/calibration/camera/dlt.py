"""The direct linear transformation: the 3 x 4 matrix from world to frame buffer, and the camera inside it.

It has no lens model, but neither does it need Cx, Cy or the sensor: a start for the refinement where the optical axis
is far from the middle, and an independent check of the sense of the axes.
Sources: Abdel-Aziz and Karara (1971); Hartley's normalisation (1997).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera


class Decomposition(NamedTuple):
    """What a DLT matrix holds; `handed` is -1 when its axes are mirrored, and then K and R are those of the mirror."""

    K: Array  # (3, 3) upper triangular, px, K[2, 2] = 1, positive diagonal
    R: Array  # (3, 3)
    T: Array  # (3,)
    handed: int


def dlt(p: ArrayLike, b: ArrayLike) -> Array:
    """The matrix P (..., 3, 4) with b ~ P [p, 1], scaled so that most depths are positive and |P[2, :3]| = 1.

    p  (..., n, 3)  world units, not in one plane; n >= 6
    b  (..., n, 2)  px
    Not finite where the points settle no matrix.
    Raises ValueError for fewer than 6 points.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    if p.shape[-2] < 6:
        raise ValueError(f"{p.shape[-2]} points; the direct linear transformation needs 6")
    P = _direct(p, b)
    depth = (p @ P[..., 2, :3, None])[..., 0] + P[..., 2, 3:]
    sign = np.where((depth > 0).mean(-1) >= 0.5, 1.0, -1.0)
    with np.errstate(divide="ignore", invalid="ignore"):  # points that settle no matrix: it projects nothing
        return np.asarray(P * (sign / np.linalg.norm(P[..., 2, :3], axis=-1))[..., None, None])


def project_dlt(P: Array, p: ArrayLike) -> Array:
    """Frame buffer px (..., n, 2) of world points (..., n, 3) by matrices P (..., 3, 4); NaN behind the camera."""
    p = np.asarray(p, float)
    with np.errstate(invalid="ignore"):
        h = p @ np.swapaxes(P[..., :3], -1, -2) + P[..., None, :, 3]
        return np.asarray(h[..., :2] / np.where(h[..., 2:] > 0, h[..., 2:], np.nan))


def homography(q: ArrayLike, b: ArrayLike) -> Array:
    """The matrix H (..., 3, 3) with b ~ H [q, 1], up to scale: the same for points in one plane.

    q (..., n, 2) coordinates in the plane, b (..., n, 2) px; n >= 4.
    """
    return _direct(np.asarray(q, float), np.asarray(b, float))


def project_homography(H: Array, q: ArrayLike) -> Array:
    """Frame buffer px (..., n, 2) of plane coordinates (..., n, 2)."""
    h = np.asarray(q, float) @ np.swapaxes(H[..., :2], -1, -2) + H[..., None, :, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(h[..., :2] / h[..., 2:])


def _direct(x: Array, b: Array) -> Array:
    """The matrix (..., 3, k + 1), up to scale, from x (..., n, k) to b (..., n, 2): the smallest eigenvector."""
    N, q = _normalised(x)
    M, u = _normalised(b)
    h = np.concatenate([q, np.ones((*q.shape[:-1], 1))], -1)
    zero = np.zeros(h.shape)
    above = np.concatenate([h, zero, -u[..., :1] * h], -1)
    below = np.concatenate([zero, h, -u[..., 1:] * h], -1)
    A = np.concatenate([above, below], -2)
    v = np.linalg.eigh(np.swapaxes(A, -1, -2) @ A)[1][..., :, 0]
    return np.asarray(np.linalg.inv(M) @ v.reshape(*v.shape[:-1], 3, -1) @ N)


def decomposed(P: Array) -> Decomposition:
    """K, R, T of one DLT matrix (3, 4), scaled as `dlt` does.

    K R is split by the QR decomposition of its transpose, turned about. With positive depths det(K R) > 0 for any true
    camera whose Xf runs right and Yf down; a negative one is a mirror.
    """
    M = P[:, :3]
    handed = 1 if np.linalg.det(M) > 0 else -1
    flip = np.eye(3)[::-1]
    Q, U = np.linalg.qr((flip @ M).T)
    K, R = flip @ U.T @ flip, flip @ Q.T
    sign = np.diag(np.where(np.diag(K) < 0, -1.0, 1.0))
    K, R = K @ sign, sign @ R
    T = np.linalg.solve(K, P[:, 3])
    return Decomposition(K / K[2, 2], R, T, handed)


def camera_from_dlt(P: Array, *, dx: float, dy: float, image_size: tuple[int, int]) -> Camera:
    """The Camera, without lens terms or skew, in a DLT matrix (3, 4). Raises ValueError where the axes are mirrored."""
    K, R, T, handed = decomposed(P)
    if handed < 0:
        raise ValueError("the axes are mirrored")
    f = K[1, 1] * dy
    return Camera(
        Cx=float(K[0, 2]),
        Cy=float(K[1, 2]),
        dx=dx,
        dy=dy,
        Sx=float(K[0, 0] * dx / f),
        f=float(f),
        kappa1=0.0,
        R=R,
        T=T,
        image_size=image_size,
    )


def _normalised(x: Array) -> tuple[Array, Array]:
    """The matrix (..., k + 1, k + 1) that centres x (..., n, k) and scales its rms distance to 1, and x so changed."""
    k = x.shape[-1]
    middle = x.mean(-2, keepdims=True)
    size = np.sqrt(((x - middle) ** 2).sum(-1).mean(-1))
    size = np.where(size > 0, size, 1.0)
    N = np.zeros((*x.shape[:-2], k + 1, k + 1))
    N[..., range(k), range(k)] = (1 / size)[..., None]
    N[..., :k, k] = -middle[..., 0, :] / size[..., None]
    N[..., k, k] = 1
    return N, (x - middle) / size[..., None, None]
