"""Tsai's camera: from a point in the world to a pixel in the frame buffer, and back to a line.

Pixel convention: the centre of the top-left pixel is (0, 0); Xf runs right, Yf runs down.
World axes are right-handed; camera axes are x right, y down, z forward.

    world p --R, T--> camera c --f--> undistorted Xu, Yu --kappa--> distorted Xd, Yd --Sx, dx, Cx--> frame buffer Xf, Yf

All functions take coordinates on the last axis with any leading axes, never loop over points,
and answer NaN where the input is NaN or where the model has no answer.
Equations: thesis 4.3.6-4.3.7 and 4.4.1-4.4.9; Tsai (1987). The lens acts from distorted to
undistorted, as Tsai wrote it; the richer terms (`geometry.lens_terms`) keep that direction.
A camera that looks through interfaces (`geometry.refraction`) sees a world point where it appears.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.lens_terms import COEFFICIENTS, RADIAL, TERMS
from vidtrack.geometry.projection import (
    Projection,
    equidistant_from_perspective,
    perspective_from_equidistant,
    perspective_jacobian,
)
from vidtrack.geometry.refraction import apparent, paths


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera in Tsai's symbols.

    Cx, Cy       px, where the optical axis meets the frame buffer
    dx, dy       mm (px where no sensor is given), the pitch of the frame buffer's columns and rows on the sensor
    Sx           horizontal scale factor, no unit
    f            effective focal length, unit of dx
    kappa1       1/unit(dx)^2, first radial term; kappa2 1/unit(dx)^4, kappa3 1/unit(dx)^6; p1, p2 1/unit(dx),
                 decentring; s1, s2 1/unit(dx), thin prism; q1, q2 1/unit(dx), what p and s lack of the second order;
                 skew, no unit
    R, T         rotation (3, 3) and translation (3,), world units: c = R p + T
    image_size   px, (width, height) of the frame buffer
    projection   perspective, or equidistant for wide lenses (see `geometry.projection`)
    through      the interfaces through which it sees, from the camera on; none: straight lines
    Raises ValueError when R is not a rotation (a mirror included) or f, dx, dy, Sx are not positive.
    """

    Cx: float
    Cy: float
    dx: float
    dy: float
    Sx: float
    f: float
    kappa1: float
    R: Array
    T: Array
    image_size: tuple[int, int]
    kappa2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    skew: float = 0.0
    kappa3: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    q1: float = 0.0
    q2: float = 0.0
    projection: Projection = "perspective"
    name: str = field(default="")
    through: tuple[Interface, ...] = ()

    def __post_init__(self) -> None:
        R = np.array(self.R, float)
        T = np.array(self.T, float)
        if R.shape != (3, 3) or T.shape != (3,):
            raise ValueError(f"R must be (3, 3) and T (3,), not {R.shape} and {T.shape}")
        if not (np.abs(R @ R.T - np.eye(3)) < 1e-5).all() or np.linalg.det(R) < 0:
            raise ValueError("R is not a rotation: its rows are not orthonormal and right-handed")
        if not (self.f > 0 and self.dx > 0 and self.dy > 0 and self.Sx > 0):
            raise ValueError(f"f, dx, dy, Sx must be positive, not {self.f}, {self.dx}, {self.dy}, {self.Sx}")
        R.setflags(write=False)
        T.setflags(write=False)
        object.__setattr__(self, "R", R)
        object.__setattr__(self, "T", T)

    @property
    def position(self) -> Array:
        """The perspective centre, (3,) world units: -R^T T."""
        return -self.R.T @ self.T

    def with_(self, **changes: object) -> Camera:
        """The same camera with some parameters replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]

    @cached_property
    def lens(self) -> dict[str, float]:
        """The coefficients of the lens terms that are not 0, skew left out."""
        return {name: value for name in TERMS if (value := float(getattr(self, name)))}

    def without_lens(self) -> Camera:
        """The same camera with every lens term 0."""
        return self.with_(**dict.fromkeys(COEFFICIENTS, 0.0))


def camera_from_world(camera: Camera, p: ArrayLike) -> Array:
    """Camera coordinates (..., 3) of world points (..., 3), world units: c = R p + T (4.4.1).

    Through interfaces: of where the points appear to the camera (`refraction.apparent`).
    """
    p = np.asarray(p, float)
    if camera.through:
        p = apparent(camera.through, camera.position, p)
    return p @ camera.R.T + camera.T


def undistorted_from_camera(camera: Camera, c: ArrayLike) -> Array:
    """Undistorted sensor coordinates (..., 2) of camera points (..., 3) (4.4.4, 4.4.5).

    NaN for points that are not in front of the camera.
    """
    c = np.asarray(c, float)
    z = np.where(c[..., 2] > 0, c[..., 2], np.nan)
    return camera.f * c[..., :2] / z[..., None]


def undistorted_from_distorted(camera: Camera, d: ArrayLike) -> Array:
    """Undistorted sensor coordinates (..., 2) of distorted ones (4.4.6, 4.4.7): those that a pinhole would give.

    The lens terms, and for an equidistant lens its projection. NaN where no light lands.
    """
    e = straightened(camera, d)
    return perspective_from_equidistant(e, camera.f) if camera.projection == "equidistant" else e


def straightened(camera: Camera, d: ArrayLike) -> Array:
    """Distorted sensor coordinates (..., 2) without the lens terms: of a lens that is exactly its projection.

    Xu = Xd (1 + kappa1 r^2 + kappa2 r^4 + kappa3 r^6) + p1 (r^2 + 2 Xd^2) + 2 p2 Xd Yd + s1 r^2 + q1 Yd^2,
    and so for Y with p2, p1, s2 and q2 Xd^2.
    NaN beyond the radius where the model folds (see `fold_radius`): no light lands there.
    """
    d = np.asarray(d, float)
    x, y = d[..., 0], d[..., 1]
    r2 = x * x + y * y
    gain = 1 + r2 * camera.kappa1
    if camera.kappa2:
        gain = gain + camera.kappa2 * r2 * r2
    if camera.kappa3:
        gain = gain + camera.kappa3 * r2 * r2 * r2
    limit = fold_radius(camera)
    if np.isfinite(limit):
        gain = np.where(r2 <= limit * limit, gain, np.nan)
    u = np.empty(d.shape)
    np.multiply(x, gain, out=u[..., 0])
    np.multiply(y, gain, out=u[..., 1])
    for name, coefficient in camera.lens.items():
        if name not in RADIAL:
            by_x, by_y = TERMS[name].shift(x, y, r2)
            u[..., 0] += coefficient * by_x
            u[..., 1] += coefficient * by_y
    return u


def fold_radius(camera: Camera) -> float:
    """The distorted radius Rd, unit of dx, where the radial model turns back on itself; inf where it never does.

    dRu/dRd = 1 + 3 kappa1 Rd^2 + 5 kappa2 Rd^4 + 7 kappa3 Rd^6 = 0; for kappa1 alone Rd = sqrt(-1 / (3 kappa1)).
    """
    return _fold_radius(float(camera.kappa1), float(camera.kappa2), float(camera.kappa3))


@lru_cache(maxsize=64)  # asked for in every step of every inversion of one lens
def _fold_radius(k1: float, k2: float, k3: float) -> float:
    if k3:
        roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
        real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0)]
        return float(np.sqrt(real.min())) if real.size else np.inf
    if k2 == 0:
        return float(np.sqrt(-1 / (3 * k1))) if k1 < 0 else np.inf
    inside = 9 * k1 * k1 - 20 * k2
    if inside < 0:
        return np.inf
    root = float(np.sqrt(inside))
    q = -(3 * k1 + (root if k1 >= 0 else -root)) / 2  # the two roots are q / (5 k2) and 1 / q
    folds = [s for s in (q / (5 * k2), 1 / q if q else np.inf) if s > 0]
    return float(np.sqrt(min(folds))) if folds else np.inf


def distorted_from_undistorted(camera: Camera, u: ArrayLike) -> Array:
    """Distorted sensor coordinates (..., 2) of undistorted ones: the inverse of 4.4.6 and 4.4.7.

    For kappa1 alone the cubic Ru = Rd (1 + kappa1 Rd^2) has a closed form by sinh (kappa1 > 0) or sin
    (kappa1 < 0) that loses nothing near kappa1 = 0; Cardano's loses 4 digits. The other terms start
    there and take Newton steps. NaN where the model folds (kappa1 < 0: Ru beyond 2/3 of the fold radius).
    """
    u = np.asarray(u, float)
    if camera.projection == "equidistant":
        u = equidistant_from_perspective(u, camera.f)
    d = _radially_distorted(camera.kappa1, u)
    if not camera.lens.keys() - {"kappa1"}:
        return d
    return _newton_distorted(camera, u, np.where(np.isfinite(d), d, u))


def _radially_distorted(kappa1: float, u: Array) -> Array:
    ru = np.hypot(u[..., 0], u[..., 1])
    s = np.sqrt(3 * abs(kappa1))
    a = 1.5 * s * ru  # sinh(3 t) or sin(3 t), where Rd = 2/s sinh(t) or sin(t)
    small = a < 1e-6  # there Rd/Ru = 1 - kappa1 Ru^2 to 1e-24
    with np.errstate(invalid="ignore", divide="ignore"):
        if kappa1 > 0:
            gain = 3 * np.sinh(np.arcsinh(a) / 3) / a
        else:
            gain = 3 * np.sin(np.arcsin(np.where(a <= 1, a, np.nan)) / 3) / a
    gain = np.where(small, 1 - kappa1 * ru * ru, gain)
    return u * gain[..., None]


def _newton_distorted(camera: Camera, u: Array, d: Array) -> Array:
    """Newton steps from d (..., 2), until the next one, by how the steps shrink, lies below rounding."""
    scale = max(float(np.nanmax(np.abs(u), initial=0.0)), 1e-300)
    limit = fold_radius(camera)
    before = np.zeros(u.shape[:-1])
    for _ in range(50):
        if np.isfinite(limit):
            with np.errstate(invalid="ignore", divide="ignore"):
                r = np.hypot(d[..., 0], d[..., 1])[..., None]
                d = np.where(r > limit, d * (0.999 * limit / r), d)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # in the plane of the lens lies infinity
            error = straightened(camera, d) - u
            J = straightened_jacobian(camera, d)
            det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
            step = np.empty(error.shape)
            step[..., 0] = (J[..., 1, 1] * error[..., 0] - J[..., 0, 1] * error[..., 1]) / det
            step[..., 1] = (J[..., 0, 0] * error[..., 1] - J[..., 1, 0] * error[..., 0]) / det
            d = d - step
            now = np.abs(step).max(-1)
            left = np.minimum(now, now * (now / before) ** 2)  # each step is a constant times the square of the last
        if not np.nanmax(left, initial=0.0) > 1e-14 * scale:
            break
        before = now
    with np.errstate(invalid="ignore"):
        good = (np.abs(straightened(camera, d) - u) <= 1e-9 * scale).all(-1) & (det > 0)
    return np.where(good[..., None], d, np.nan)


def undistorted_jacobian(camera: Camera, d: Array) -> Array:
    """d(Xu, Yu)/d(Xd, Yd), (..., 2, 2), no unit, at distorted sensor coordinates d (..., 2)."""
    J = straightened_jacobian(camera, d)
    if camera.projection == "equidistant":
        J = perspective_jacobian(straightened(camera, d), camera.f) @ J
    return J


def straightened_jacobian(camera: Camera, d: Array) -> Array:
    """Derivatives (..., 2, 2) of `straightened` by the distorted sensor coordinates d (..., 2)."""
    x, y = d[..., 0], d[..., 1]
    r2 = x * x + y * y
    k1, k2, k3 = camera.kappa1, camera.kappa2, camera.kappa3
    gain = 1 + k1 * r2 + k2 * r2 * r2
    slope = 2 * k1 + 4 * k2 * r2
    if k3:
        gain, slope = gain + k3 * r2**3, slope + 6 * k3 * r2 * r2
    cross = slope * x * y
    J = np.empty((*d.shape[:-1], 2, 2))
    J[..., 0, 0] = gain + slope * x * x
    J[..., 1, 1] = gain + slope * y * y
    J[..., 0, 1] = cross
    J[..., 1, 0] = cross
    for name, coefficient in camera.lens.items():
        if name not in RADIAL:
            for (i, j), part in zip(((0, 0), (0, 1), (1, 0), (1, 1)), TERMS[name].slope(x, y, r2), strict=True):
                J[..., i, j] += coefficient * part
    return J


def frame_buffer_from_distorted(camera: Camera, d: ArrayLike) -> Array:
    """Frame buffer px (..., 2) of distorted sensor coordinates: Xf = (Sx Xd + skew Yd)/dx + Cx (4.4.8, 4.4.9)."""
    d = np.asarray(d, float)
    Xf = (camera.Sx * d[..., 0] + camera.skew * d[..., 1]) / camera.dx + camera.Cx
    Yf = d[..., 1] / camera.dy + camera.Cy
    return np.stack([Xf, Yf], -1)


def distorted_from_frame_buffer(camera: Camera, b: ArrayLike) -> Array:
    """Distorted sensor coordinates (..., 2) of frame buffer px: Xd = (dx (Xf - Cx) - skew Yd)/Sx (4.3.6, 4.3.7)."""
    b = np.asarray(b, float)
    d = np.empty(b.shape)
    np.multiply(b[..., 1] - camera.Cy, camera.dy, out=d[..., 1])
    d[..., 0] = (camera.dx * (b[..., 0] - camera.Cx) - camera.skew * d[..., 1]) / camera.Sx
    return d


def undistorted_from_frame_buffer(camera: Camera, b: ArrayLike) -> Array:
    """Undistorted sensor coordinates (..., 2) of frame buffer px (..., 2)."""
    return undistorted_from_distorted(camera, distorted_from_frame_buffer(camera, b))


def project(camera: Camera, p: ArrayLike) -> Array:
    """Frame buffer px (..., 2) where the camera sees world points (..., 3), inside the picture or not.

    NaN for points behind the camera or beyond the fold of the lens model.
    On the optical axis the answer is (Cx, Cy).
    """
    u = undistorted_from_camera(camera, camera_from_world(camera, p))
    return frame_buffer_from_distorted(camera, distorted_from_undistorted(camera, u))


def line_of_sight(camera: Camera, b: ArrayLike) -> tuple[Array, Array]:
    """The line in the world that a frame buffer position sees: where it starts and unit directions (..., 3).

    It starts at the perspective centre, (3,); through interfaces at the last plane, (..., 3), in the medium behind it.
    """
    d = directions(camera, b)
    if not camera.through:
        return camera.position, d
    last = paths(camera.through, camera.position, d)[-1]
    return tuple(np.ascontiguousarray(each.T).reshape(d.shape) for each in (last.q, last.d))  # type: ignore[return-value]


def directions(camera: Camera, b: ArrayLike) -> Array:
    """Unit directions in the world (..., 3) in which the camera itself sees frame buffer positions (..., 2) px."""
    u = undistorted_from_frame_buffer(camera, b)
    c = np.empty((*u.shape[:-1], 3))
    c[..., :2] = u / camera.f
    c[..., 2] = 1.0
    c /= np.linalg.norm(c, axis=-1, keepdims=True)
    return np.asarray(c @ camera.R)


def units_per_px(camera: Camera, p: ArrayLike) -> Array:
    """World units that one row of the picture spans at points (..., 3), square to the optical axis: (...)."""
    depth: Array = camera_from_world(camera, p)[..., 2]
    return depth * camera.dy / camera.f


def contains(camera: Camera, b: ArrayLike, margin: float = 0.0) -> NDArray[np.bool_]:
    """Whether frame buffer positions (..., 2) px lie inside the picture by at least `margin` px."""
    b = np.asarray(b, float)
    width, height = camera.image_size
    X, Y = b[..., 0], b[..., 1]
    return (X >= margin - 0.5) & (X <= width - 0.5 - margin) & (Y >= margin - 0.5) & (Y <= height - 0.5 - margin)
