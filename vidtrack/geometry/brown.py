"""Lenses as other programs write them: from undistorted to distorted positions (Brown), the other way than Tsai's.

    x = X/Z, y = Y/Z                      r^2 = x^2 + y^2      (fisheye: x, y scaled by theta/r, theta = arctan r)
    x' = x a + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4,  a = (1 + k1 r^2 + k2 r^4 + ...) / (1 + k4 r^2 + ...)
    Xf = fx x' + skew y' + cx,            Yf = fy y' + cy

Sources: Brown (1966); the documentation of OpenCV's calib3d, whose names these are; Kannala and Brandt (2006).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.projection import equidistant_from_perspective


class BrownLens(NamedTuple):
    """A lens from undistorted to distorted positions.

    fx, fy, cx, cy   px; the centre of the top-left pixel is (0, 0)
    skew             px, what y' adds to Xf
    k                no unit, k1, k2, k3 and on: of r^2, r^4, r^6; of theta^2, theta^4 and on where fisheye
    p1, p2           tangential, OpenCV's order (Metashape's p1 and p2 are the other way round)
    denominator      k4, k5, k6 of OpenCV's rational model
    prism            s1, s2 for x and s3, s4 for y: of r^2 and r^4
    """

    fx: float
    fy: float
    cx: float
    cy: float
    image_size: tuple[int, int]
    k: tuple[float, ...] = ()
    p1: float = 0.0
    p2: float = 0.0
    denominator: tuple[float, ...] = ()
    prism: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    skew: float = 0.0
    fisheye: bool = False


def distorted(lens: BrownLens, x: ArrayLike) -> Array:
    """Frame buffer px (..., 2) of undistorted positions x = X/Z, y = Y/Z (..., 2)."""
    x = np.asarray(x, float)
    if lens.fisheye:
        x = equidistant_from_perspective(x, 1.0)
    X, Y = x[..., 0], x[..., 1]
    r2 = X * X + Y * Y
    gain = _series(lens.k, r2) / _series(lens.denominator, r2)
    s1, s2, s3, s4 = lens.prism
    Xd = X * gain + 2 * lens.p1 * X * Y + lens.p2 * (r2 + 2 * X * X) + s1 * r2 + s2 * r2 * r2
    Yd = Y * gain + lens.p1 * (r2 + 2 * Y * Y) + 2 * lens.p2 * X * Y + s3 * r2 + s4 * r2 * r2
    return np.stack([lens.fx * Xd + lens.skew * Yd + lens.cx, lens.fy * Yd + lens.cy], -1)


def _series(terms: tuple[float, ...], r2: Array) -> Array:
    value = np.ones(np.shape(r2))
    for n, term in enumerate(terms, 1):
        value = value + term * r2**n
    return value


def undistorted(lens: BrownLens, b: ArrayLike) -> Array:
    """Undistorted positions x = X/Z, y = Y/Z (..., 2) of frame buffer px (..., 2): the inverse of `distorted`.

    NaN where the lens has none: beyond its fold, or from 90 degrees on. The answer is followed outwards from the
    principal point, so that it lies on the side of the fold where light is.
    """
    b = np.asarray(b, float)
    centre = np.array([lens.cx, lens.cy])
    x = np.zeros(b.shape)
    h = 1e-6
    steps = 8
    for n in range(1, steps + 1):
        goal = centre + (b - centre) * (n / steps)
        for _ in range(4 if n < steps else 12):
            error = distorted(lens, x) - goal
            J = np.stack([(distorted(lens, x + s) - distorted(lens, x - s)) / (2 * h) for s in h * np.eye(2)], -1)
            det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
            with np.errstate(divide="ignore", invalid="ignore"):
                step_x = (J[..., 1, 1] * error[..., 0] - J[..., 0, 1] * error[..., 1]) / det
                step_y = (J[..., 0, 0] * error[..., 1] - J[..., 1, 0] * error[..., 0]) / det
            x = x - np.stack([step_x, step_y], -1)
            x = np.where((det > 0)[..., None], x, np.nan)
    good = (np.abs(distorted(lens, x) - b) < 1e-6 * max(lens.fx, 1.0)).all(-1)
    return np.where(good[..., None], x, np.nan)


def changed(lens: BrownLens, name: str, by: float) -> BrownLens:
    """The lens with one of its numbers (fx, fy, cx, cy, skew, k1 and on, p1, p2) moved. ValueError for another name."""
    if name in ("fx", "fy", "cx", "cy", "p1", "p2", "skew"):
        return lens._replace(**{name: getattr(lens, name) + by})
    place = int(name[1:]) - 1 if name[:1] == "k" and name[1:].isdigit() else -1
    k = list(lens.k)
    if not 0 <= place < max(len(k), 4 if lens.fisheye else 3):
        raise ValueError(f"no such number of a lens: {name}")
    k += [0.0] * (place + 1 - len(k))
    k[place] += by
    return lens._replace(k=tuple(k))
