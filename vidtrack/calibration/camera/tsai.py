"""Tsai's closed form: a camera from calibration points by linear algebra alone, given Cx, Cy and the sensor's pitch.

Radial distortion moves a point along the ray from the centre, so the direction of (Xd, Yd) is that of the camera's
(x, y): Xd y = Yd x, linear in R, T and Sx (4.4.18). Unlike the thesis, and to lose nothing when Ty is near 0 or the
world's origin is far, the points are centred and scaled first and the eight unknowns kept homogeneous.
Every function takes any leading axes of Cx, Cy, dx, dy: a whole search over centres is one call.
Sources: Tsai (1987); thesis 4.4.14-4.4.33, with the corrections of its shifted indices (Tx = a4 Ty / Sx and so on).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera


class ClosedForm(NamedTuple):
    """A camera's parameters before anything is known of their sense; f < 0 means mirrored axes."""

    Cx: Array  # (...)
    Cy: Array
    dx: Array
    dy: Array
    Sx: Array
    f: Array
    kappa1: Array
    R: Array  # (..., 3, 3)
    T: Array  # (..., 3)
    depth: Array  # (..., n) camera z of the points, world units


def closed_form(
    p: ArrayLike,
    b: ArrayLike,
    *,
    Cx: ArrayLike,
    Cy: ArrayLike,
    dx: ArrayLike,
    dy: ArrayLike,
    Sx: float | None = None,
    kappa1: float | None = None,
    coplanar: bool = False,
) -> ClosedForm:
    """Tsai's camera from at least 7 points that do not lie in one plane, or from at least 5 that do.

    p               (n, 3)  world units
    b               (n, 2)  px
    Cx, Cy, dx, dy  (...)   px, and mm (or px) a px
    Sx, kappa1      held at these values where given; one plane cannot determine Sx, and Tsai then takes it to be 1
    coplanar        the points lie in one plane, any plane of the world
    Mirrored axes come out with f < 0 or points behind the camera: see `vidtrack.calibration.camera.gates`.
    Raises ValueError for too few points.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    least, method = (5, "coplanar") if coplanar else (7, "noncoplanar")
    if len(p) < least:
        raise ValueError(f"{len(p)} points; the {method} method needs {least}")
    middle, q, size = centred(p)
    Cx, Cy, dx, dy, d = _sensor(b, Cx, Cy, dx, dy)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # points that settle no camera: not finite
        if coplanar:
            S = np.full(Cx.shape, 1.0 if Sx is None else Sx)
            d[..., 0] /= S[..., None]
            rotations, t_xy = _two_poses_from_a_plane(q, d)
        else:
            R, t_xy, found = _pose_from_space(q, d)
            S = found if Sx is None else np.full(found.shape, Sx)
            d[..., 0] /= S[..., None]
            rotations = [R]
        solved = [_finish(p, middle, d, R, size * t_xy, (Cx, Cy, dx, dy, S), kappa1) for R in rotations]
        return _choose(*solved) if coplanar else solved[0]


def _pose_from_space(q: Array, d: Array) -> tuple[Array, Array, Array]:
    """R (..., 3, 3), Tx, Ty (..., 2) and Sx (...) from centred points q (n, 3) and d (..., n, 2): Sx Xd, Yd."""
    X, Y = d[..., 0], d[..., 1]
    h = np.concatenate([q, np.ones((len(q), 1))], -1)  # (n, 4)
    A = np.concatenate([Y[..., None] * h, -X[..., None] * h], -1)  # (..., n, 8): [Sx r1, Sx Tx, r2, Ty]
    a = _null_vector(A)
    length_x = np.linalg.norm(a[..., 0:3], axis=-1)
    length_y = np.linalg.norm(a[..., 4:7], axis=-1)
    Sx = length_x / length_y  # (4.4.26)
    a = a * (_vote(a, h, X, Y) / length_y)[..., None]
    rows = np.stack([a[..., 0:3] / Sx[..., None], a[..., 4:7]], -2)
    return _rotation_from_two_rows(rows), np.stack([a[..., 3] / Sx, a[..., 7]], -1), Sx


def _two_poses_from_a_plane(q: Array, d: Array) -> tuple[list[Array], Array]:
    """The two R (..., 3, 3) that are possible, and Tx, Ty (..., 2), from centred points q (n, 3) and d (..., n, 2).

    Two rows of R are known but for one column each; that they are orthogonal unit vectors settles their length:
    with rows rho (r1, r2), rho (r4, r5) and A, B their squared lengths, D their product,
    (rho^2 - A)(rho^2 - B) = D^2. Of the two cameras that are left, the one with f > 0 is meant.
    """
    X, Y = d[..., 0], d[..., 1]
    plane = plane_axes(q)  # rows: two axes in the plane, and its normal
    flat = q @ plane.T
    h = np.stack([flat[:, 0], flat[:, 1], np.ones(len(q))], -1)
    A = np.concatenate([Y[..., None] * h, -X[..., None] * h], -1)  # (..., n, 6)
    a = _null_vector(A)
    a1, a2, a4, a5 = a[..., 0], a[..., 1], a[..., 3], a[..., 4]
    AA, BB, D = a1**2 + a2**2, a4**2 + a5**2, a1 * a4 + a2 * a5
    rho2 = (AA + BB + np.sqrt((AA - BB) ** 2 + 4 * D**2)) / 2
    a = a * (_vote(a, h, X, Y) / np.sqrt(rho2))[..., None]
    r3 = np.sqrt(np.maximum(1 - AA / rho2, 0))
    r6 = -np.where(D < 0, -1.0, 1.0) * np.sqrt(np.maximum(1 - BB / rho2, 0))
    both = []
    for sign in (1.0, -1.0):
        rows = np.stack(
            [np.stack([a[..., 0], a[..., 1], sign * r3], -1), np.stack([a[..., 3], a[..., 4], sign * r6], -1)], -2
        )
        both.append(_rotation_from_two_rows(rows) @ plane)
    return both, np.stack([a[..., 2], a[..., 5]], -1)


def camera_from_closed_form(solution: ClosedForm, image_size: tuple[int, int]) -> Camera:
    """The Camera of a single closed form. Raises ValueError where f, Sx or R make no camera."""
    Cx, Cy, dx, dy, Sx, f, kappa1 = (float(value) for value in solution[:7])
    return Camera(Cx, Cy, dx, dy, Sx, f, kappa1, R=solution.R, T=solution.T, image_size=image_size)


def centred(p: Array) -> tuple[Array, Array, float]:
    """The mean (3,) of points (n, 3), the points about it in units of their spread, and that spread (rms distance)."""
    middle = p.mean(0)
    size = float(np.sqrt(((p - middle) ** 2).sum(-1).mean()))
    size = size if size > 0 else 1.0
    return middle, (p - middle) / size, size


def plane_axes(q: Array) -> Array:
    """A rotation (3, 3) whose rows are the two longest directions of centred points (n, 3) and their plane's normal."""
    axes = np.linalg.svd(q, full_matrices=False)[2]
    if np.linalg.det(axes) < 0:
        axes[2] *= -1
    return np.asarray(axes)


def _sensor(
    b: Array, Cx: ArrayLike, Cy: ArrayLike, dx: ArrayLike, dy: ArrayLike
) -> tuple[Array, Array, Array, Array, Array]:
    Cx, Cy, dx, dy = (np.array(a) for a in np.broadcast_arrays(*(np.asarray(v, float) for v in (Cx, Cy, dx, dy))))
    X = dx[..., None] * (b[:, 0] - Cx[..., None])  # (4.4.16) times Sx
    Y = dy[..., None] * (b[:, 1] - Cy[..., None])  # (4.4.17)
    return Cx, Cy, dx, dy, np.stack([X, Y], -1)


def _null_vector(A: Array) -> Array:
    """The unit vector (..., k) that A (..., n, k) shrinks most.

    By singular values for one camera; for a search over many, by the eigenvalues of A^T A, which are as good as the
    square root of rounding and several times faster.
    """
    if A.ndim > 2:
        return np.asarray(np.linalg.eigh(np.swapaxes(A, -1, -2) @ A)[1][..., :, 0])
    return np.asarray(np.linalg.svd(A, full_matrices=len(A) < A.shape[-1])[2][-1])


def _vote(a: Array, h: Array, X: Array, Y: Array) -> Array:
    """+1 or -1 (...): the sense in which most points lie on their own side of the axis, Xd x + Yd y > 0."""
    k = h.shape[-1]
    x = (h @ a[..., :k, None])[..., 0]
    y = (h @ a[..., k:, None])[..., 0]
    return np.where((X * x + Y * y > 0).mean(-1) >= 0.5, 1.0, -1.0)


def _rotation_from_two_rows(rows: Array) -> Array:
    """The rotation (..., 3, 3) whose first two rows are the orthonormal ones nearest to `rows` (..., 2, 3); NaN."""
    finite = np.asarray(np.isfinite(rows).all((-2, -1)))[..., None, None]
    U, _, Vt = np.linalg.svd(np.where(finite, rows, 0), full_matrices=False)
    near = np.where(finite, U @ Vt, np.nan)
    return np.concatenate([near, np.cross(near[..., 0, :], near[..., 1, :])[..., None, :]], -2)


def _finish(
    p: Array,
    middle: Array,
    d: Array,
    R: Array,
    t_xy: Array,
    sensor: tuple[Array, Array, Array, Array, Array],
    kappa1: float | None,
) -> ClosedForm:
    """f, kappa1 and Tz from the perspective equations (4.4.12, 4.4.13), then T for the world's own origin."""
    c = (p - middle) @ np.swapaxes(R, -1, -2)
    xy, w = c[..., :2] + t_xy[..., None, :], c[..., 2]
    f, tz, k = _depth(xy, w, d, kappa1)
    t = np.concatenate([t_xy, tz[..., None]], -1)
    T = t - (R @ middle[:, None])[..., 0]
    return ClosedForm(*sensor, f, k, R, T, w + tz[..., None])


def _depth(xy: Array, w: Array, d: Array, held: float | None, rounds: int = 5) -> tuple[Array, Array, Array]:
    """f, Tz and kappa1 (...), the last perhaps held: first f x - Tz Xd = w Xd, linear without distortion;
    then a few Gauss-Newton steps on f x / (w + Tz) - Xd (1 + kappa1 r^2)."""
    A = np.stack([xy, -d], -1)
    A = A.reshape(*A.shape[:-3], -1, 2)
    y = (w[..., None] * d).reshape(*A.shape[:-2], -1)
    f, tz = np.moveaxis(_solved(A, y), -1, 0)
    kappa1 = np.full(f.shape, held or 0.0)
    r2 = (d**2).sum(-1)[..., None]
    for _ in range(rounds):
        z = (w + tz[..., None])[..., None]
        ray = xy / z
        gain = 1 + kappa1[..., None, None] * r2
        error = d * gain - f[..., None, None] * ray
        columns = [ray, -f[..., None, None] * ray / z, -d * r2][: 3 if held is None else 2]
        J = np.stack(columns, -1)
        step = np.nan_to_num(_solved(J.reshape(*A.shape[:-2], -1, len(columns)), error.reshape(*A.shape[:-2], -1)))
        f, tz = f + step[..., 0], tz + step[..., 1]
        kappa1 = kappa1 + step[..., 2] if held is None else kappa1
    return f, tz, kappa1


def _solved(A: Array, y: Array) -> Array:
    """Least squares (..., k) of A (..., m, k) x = y (..., m), columns scaled; NaN where A is singular."""
    length = np.linalg.norm(A, axis=-2, keepdims=True)
    length = np.where(length > 0, length, 1.0)
    A = A / length
    At = np.swapaxes(A, -1, -2)
    M, v = At @ A, At @ y[..., None]
    singular = np.linalg.det(M) < 1e-14
    M = np.where(singular[..., None, None], np.eye(M.shape[-1]), M)
    x = np.linalg.solve(M, v)[..., 0] / length[..., 0, :]
    return np.asarray(np.where(singular[..., None], np.nan, x))


def _choose(one: ClosedForm, other: ClosedForm) -> ClosedForm:
    """For each leading index the solution whose f is positive."""
    take = (one.f > 0) | ~(other.f > 0)

    def pick(a: Array, b: Array) -> Array:
        return np.where(take.reshape(take.shape + (1,) * (a.ndim - take.ndim)), a, b)

    return ClosedForm(*(pick(a, b) for a, b in zip(one, other, strict=True)))
