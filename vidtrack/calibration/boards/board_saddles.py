"""Corners where four squares of a board meet, to a hundredth of a pixel: the two edges fitted to the grey levels.

    level(x) = m + g . (x - c) + A E(n1 . (x - c)) E(n2 . (x - c)),    E from -1 to 1 across an edge

E is the mean over the pixel of an edge blurred by a Gaussian: of the box that the pixel is across the edge exactly,
along it by its variance. The corner c, the directions of both edges, the blur and the levels m, g, A are fitted by
least squares (Levenberg-Marquardt), all corners of a picture at once.

Why not where the gradients meet (OpenCV's cornerSubPix): these are differences of interpolated levels, which err by up
to a tenth of a pixel where edges are sharp, by where the corner lies between the pixels. On a board seen square on,
whole rows of corners lie alike between the pixels and err together, as no sd of single corners allows for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from vidtrack.arrays import Array


@dataclass(frozen=True)
class Saddles:
    """How corners are fitted."""

    reach: float = 0.45
    """Squares on each side of a corner that are used: beyond half of one the next corner is near."""
    widest: int = 7
    """px on each side, at most: a lens bends longer edges."""
    beside: float = 1.0
    """px that stay free before the tags in the white squares: their edges are blurred too."""
    narrowest: float = 1.0
    """px of white beside an edge that are used nevertheless: tags lie alike on both sides of a corner."""
    fewest: int = 14
    """Pixels of a corner, at least: nine numbers are fitted."""
    steps: int = 30
    first_steps: int = 4
    """And before it is settled which pixels are used."""
    close: float = 5e-4
    """px, of a step that ends the search."""
    stuck: float = 1e5
    """Damping beyond which no step helps."""
    least_contrast: float = 4.0
    """Grey levels between m and a square, below which there is no corner."""
    misfit: float = 0.25
    """Share of the contrast that the fit leaves, rms, from which something else is there than a corner."""
    apart: float = 1.5
    """px between the detector's corner and the fitted one, at most."""


SADDLES = Saddles()
_ROOT = (2 * np.pi) ** 0.5


def saddle_corners(
    picture: NDArray[np.uint8], rough: Array, across: Array, up: Array, free: float = 1.0
) -> tuple[Array, Array]:
    """Corners near `rough` (n, 2) px in a picture (rows, columns), and the sd of each (n,) px; NaN where none fits.

    across, up  (n, 2) px along a square's side, at each corner
    free        share of a white square's side, from its rim, that is white: less than 1 where it holds a tag
    """
    rough = np.asarray(rough, float)
    found, sd = rough.copy(), np.full(len(rough), np.nan)
    for steps in (SADDLES.first_steps, SADDLES.steps):  # which pixels are used follows from the corner
        found, sd = _fitted(picture, np.where(np.isfinite(found), found, rough), across, up, free, steps)
    off = ~(np.linalg.norm(found - rough, axis=-1) <= SADDLES.apart)
    found[off], sd[off] = np.nan, np.nan
    return found, sd


def _window(
    picture: NDArray[np.uint8], b: Array, across: Array, up: Array, free: float
) -> tuple[Array, Array, NDArray[np.bool_], Array]:
    """About each corner: where its pixels are from it (n, k, 2) px, their levels (n, k), which are used, and which of
    the board's quadrants is white: 1 where that between `across` and `up` is, or -1."""
    side = np.minimum(np.linalg.norm(across, axis=-1), np.linalg.norm(up, axis=-1))
    half = int(np.clip(np.ceil(SADDLES.reach * side.max()), 2, SADDLES.widest))
    dx, dy = (each.ravel() for each in np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1)))
    good: NDArray[np.bool_] = np.asarray(np.isfinite(b).all(-1))
    middle = np.rint(np.where(good[:, None], b, 0)).astype(int)
    X, Y = middle[:, :1] + dx, middle[:, 1:] + dy
    rows, columns = picture.shape
    inside = (X >= 0) & (Y >= 0) & (X < columns) & (Y < rows) & good[:, None]
    level = picture[np.clip(Y, 0, rows - 1), np.clip(X, 0, columns - 1)].astype(float)
    x: Array = np.stack([X, Y], -1).astype(float) - np.where(good[:, None], b, 0)[:, None]
    det = across[:, 0] * up[:, 1] - across[:, 1] * up[:, 0]
    p = (x[..., 0] * up[:, None, 1] - x[..., 1] * up[:, None, 0]) / det[:, None]  # squares from the corner
    q = (x[..., 1] * across[:, None, 0] - x[..., 0] * across[:, None, 1]) / det[:, None]
    near = inside & (np.abs(p) <= SADDLES.reach) & (np.abs(q) <= SADDLES.reach)
    count = np.maximum(near.sum(-1, keepdims=True), 1)
    mean = (level * near).sum(-1, keepdims=True) / count
    white = np.where(((level - mean) * np.sign(p * q) * near).sum(-1) >= 0, 1.0, -1.0)
    if free < 1:
        strip = np.maximum(free - SADDLES.beside / side, SADDLES.narrowest / side)[:, None]
        tag = (np.sign(p * q) * white[:, None] > 0) & (np.abs(p) > strip) & (np.abs(q) > strip)
        near &= ~tag
    return x, level, near, np.asarray(white)


def _edge(d: Array, nx: Array, ny: Array, blur: Array) -> tuple[Array, Array, Array]:
    """E at distances d (n, k) px from an edge of normal nx, ny (n,), and its derivatives by d and by the blur (n,)."""
    wide, narrow = np.maximum(np.abs(nx), np.abs(ny)), np.minimum(np.abs(nx), np.abs(ny))
    h, s = (wide / 2)[:, None], np.hypot(blur, narrow / 12**0.5)[:, None]
    a, z = (d + h) / s, (d - h) / s
    A, Z = ndtr(a), ndtr(z)
    fa, fz = np.exp(-0.5 * a * a) / _ROOT, np.exp(-0.5 * z * z) / _ROOT
    value = ((d + h) * A - (d - h) * Z + s * (fa - fz)) / (2 * h)
    return 2 * value - 1, (A - Z) / h, (fa - fz) / h * blur[:, None] / s


def _model(value: Array, x: Array, w: Array) -> tuple[Array, Array]:
    """Levels (n, k) and their derivatives (n, k, 9) by c, both directions, blur, A, m and g, times the weights w."""
    X, Y = x[..., 0] - value[:, 0, None], x[..., 1] - value[:, 1, None]
    edges = []
    for k in (2, 3):
        nx, ny = np.cos(value[:, k, None]), np.sin(value[:, k, None])
        edges.append((nx, ny, Y * nx - X * ny, *_edge(X * nx + Y * ny, nx[:, 0], ny[:, 0], value[:, 4])))
    (nx1, ny1, t1, e1, d1, s1), (nx2, ny2, t2, e2, d2, s2) = edges
    A = w * value[:, 5, None]
    by_1, by_2 = A * d1 * e2, A * e1 * d2
    J = np.empty((*X.shape, 9))
    J[..., 0], J[..., 1] = -by_1 * nx1 - by_2 * nx2, -by_1 * ny1 - by_2 * ny2
    J[..., 2], J[..., 3] = by_1 * t1, by_2 * t2
    J[..., 4] = A * (s1 * e2 + e1 * s2)
    J[..., 5], J[..., 6] = w * e1 * e2, w
    J[..., 7], J[..., 8] = w * x[..., 0], w * x[..., 1]
    return (J[..., 5:] @ value[:, 5:, None])[..., 0], J


def _fitted(
    picture: NDArray[np.uint8], b: Array, across: Array, up: Array, free: float, steps: int
) -> tuple[Array, Array]:
    x, level, used, white = _window(picture, b, across, up, free)
    w = used.astype(float)
    count = w.sum(-1)
    value = np.zeros((len(b), 9))
    for k, (along, other) in ((2, (up, across)), (3, (across, up))):  # normals of the edges along `up`, `across`
        n = np.stack([along[:, 1], -along[:, 0]], -1)
        n = n * np.sign((n * other).sum(-1, keepdims=True))
        value[:, k] = np.arctan2(n[:, 1], n[:, 0])
    value[:, 4] = 0.5
    mean = (level * w).sum(-1) / np.maximum(count, 1)
    value[:, 6] = mean
    value[:, 5] = white * np.sqrt((w * (level - mean[:, None]) ** 2).sum(-1) / np.maximum(count, 1))
    damping = np.full(len(b), 1e-3)
    at, J = _model(value, x, w)
    r = w * level - at
    cost = (r * r).sum(-1)
    go = np.flatnonzero(count >= SADDLES.fewest)  # those that still move
    for _ in range(steps):
        own = J[go].swapaxes(-1, -2)
        N = own @ J[go]
        more = damping[go, None] * np.einsum("nii->ni", N) + 1e-6
        step = np.linalg.solve(N + more[..., None] * np.eye(9), own @ r[go, :, None])[..., 0]
        trial = value[go] + step
        trial[:, :2] = np.clip(trial[:, :2], -2 * SADDLES.apart, 2 * SADDLES.apart)
        trial[:, 4] = np.clip(trial[:, 4], 0.05, SADDLES.widest)
        at, by = _model(trial, x[go], w[go])
        left = w[go] * level[go] - at
        squares = (left * left).sum(-1)
        better = squares <= cost[go]
        those = go[better]
        value[those], r[those], J[those], cost[those] = trial[better], left[better], by[better], squares[better]
        damping[go] = np.where(better, damping[go] / 10, damping[go] * 10)
        go = go[(np.abs(step[:, :2]).max(-1) > SADDLES.close) & (damping[go] < SADDLES.stuck)]
        if not len(go):
            break
    N = J.swapaxes(-1, -2) @ J
    variance = cost / np.maximum(count - 9, 1)
    C = np.linalg.pinv(N, hermitian=True)[:, :2, :2] * variance[:, None, None]
    sd = np.sqrt(np.einsum("nii->n", C) / 2)
    contrast = np.abs(value[:, 5])
    lost = (count < SADDLES.fewest) | (contrast < SADDLES.least_contrast) | (value[:, 5] * white <= 0)
    lost |= ~(np.sqrt(variance) <= SADDLES.misfit * contrast)
    found = b + value[:, :2]
    return np.where(lost[:, None], np.nan, found), np.where(lost, np.nan, sd)
