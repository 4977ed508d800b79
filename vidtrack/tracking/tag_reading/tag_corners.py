"""The corners of a tag to a hundredth of a pixel, each with an sd from the picture: its edges fitted, and intersected.

Across an edge the grey level is dark + (bright - dark) Phi(d / s), d the distance from the edge's line and s the blur.
Line, levels and blur are fitted by least squares to every pixel of a strip along the edge (Gauss-Newton), so that the
position of pixels beside the edge biases nothing, and the residuals give the covariance. Each corner has its own
halves of the two edges that meet in it: no two corners share a pixel, so that their errors are independent, and a
lens that bends the edge bends half of it a quarter as much.

Where levels are a power of light (a camera's gamma), an edge that is symmetric in light is not so in levels: `Tone`
puts the power into the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array


@dataclass(frozen=True)
class Edges:
    """How edges are fitted.

    reach      modules on each side of an edge that are used: beyond them the code begins
    widest     px on each side, at most: farther off there is nothing to learn of the edge
    ends       modules left out at a corner, where the other edge is near
    fewest     pixels of a half edge, at least
    blurred    modules of blur from which black and white mix: no corner
    steps      of the fit, at most
    apart      modules between the detector's corner and the fitted one, at most
    least_sd   px, that no corner is better known than
    """

    reach: float = 0.8
    widest: float = 4.0
    ends: float = 0.5
    fewest: int = 12
    blurred: float = 0.6
    steps: int = 12
    apart: float = 1.0
    least_sd: float = 0.003


EDGES = Edges()


class Tone(NamedTuple):
    """Levels are top (light / top) ^ power: power 1 where they are proportional to light, 1 / 2.2 as most films are."""

    power: float = 1.0
    top: float = 255.0

    def level(self, light: Array) -> Array:
        return self.top * (self._share(light)) ** self.power

    def slope(self, light: Array) -> Array:
        """d(level)/d(light)."""
        return self.power * self._share(light) ** (self.power - 1)

    def light(self, level: float) -> float:
        return float(self.top * self._share(np.array(level)) ** (1 / self.power))

    def _share(self, value: Array) -> Array:
        return np.maximum(value / self.top, 1e-4)


LINEAR = Tone()


class TagCorners(NamedTuple):
    """Corners of one tag; NaN where an edge cannot be fitted."""

    b: Array  # (4, 2) px
    sd: Array  # (4, 2) px
    blur: float  # px, sd of the edges' blur: the median of those fitted
    contrast: float  # grey levels between black and white
    misfit: float  # grey levels squared, mean over the pixels of an edge, the median of the edges


def tag_corners(picture: NDArray[np.generic], rough: Array, modules: int, tone: Tone = LINEAR) -> TagCorners:
    """The corners of a tag near `rough` (4, 2) px, in a picture (rows, columns) of any depth.

    modules   along a side of the tag, the black border included
    tone      how levels follow light
    """
    b, sd = np.full((4, 2), np.nan), np.full((4, 2), np.nan)
    corners: Array = np.asarray(rough, float)
    blurs: list[float] = []
    contrasts: list[float] = []
    misfits: list[float] = []
    for _ in range(2):  # again with the better corners: the strips lie truer
        b, sd, blurs, contrasts, misfits = _intersections(picture, corners, modules, tone)
        if not np.isfinite(b).all():
            break
        corners = b
    side = np.linalg.norm(np.roll(corners, -1, 0) - corners, axis=-1)
    module = side.min() / modules
    with np.errstate(invalid="ignore"):
        off = np.linalg.norm(b - rough, axis=-1) > EDGES.apart * module + 1.0
    b[off], sd[off] = np.nan, np.nan
    blur = float(np.median(blurs)) if blurs else float("nan")
    if not blur <= EDGES.blurred * module:
        b[:], sd[:] = np.nan, np.nan
    contrast, misfit = (float(of(own)) if own else np.nan for of, own in ((np.median, contrasts), (np.median, misfits)))
    return TagCorners(b, sd, blur, contrast, misfit)


def _intersections(
    picture: NDArray[np.generic], corners: Array, modules: int, tone: Tone
) -> tuple[Array, Array, list[float], list[float], list[float]]:
    b, sd = np.full((4, 2), np.nan), np.full((4, 2), np.nan)
    blurs, contrasts, misfits = [], [], []
    middle = corners.mean(0)
    for k in range(4):
        lines = []
        for other in (corners[k - 1], corners[(k + 1) % 4]):
            fit = _half_edge(picture, corners[k], other, middle, modules, tone)
            if fit is None:
                break
            lines.append(fit)
            blurs.append(fit.blur)
            contrasts.append(fit.contrast)
            misfits.append(fit.misfit)
        if len(lines) == 2:
            b[k], sd[k] = _meet(corners[k], lines[0], lines[1])
    return b, sd, blurs, contrasts, misfits


class _Line(NamedTuple):
    """Points x with normal . (x - corner) = offset + slope (along . (x - corner)), and the covariance of both."""

    normal: Array
    along: Array
    value: Array  # (2,) offset px, slope
    covariance: Array  # (2, 2)
    blur: float
    contrast: float
    misfit: float


def _half_edge(
    picture: NDArray[np.generic], corner: Array, other: Array, middle: Array, modules: int, tone: Tone
) -> _Line | None:
    """The half of an edge that is nearer to a corner; None where it cannot be fitted."""
    length = float(np.linalg.norm(other - corner))
    if not length > 0:
        return None
    module = length / modules
    along = (other - corner) / length
    normal = np.array([-along[1], along[0]])
    if normal @ (corner - middle) < 0:  # from the black border outwards, to the white
        normal = -normal
    reach = min(EDGES.reach * module, EDGES.widest)
    first, last = EDGES.ends * module, length / 2
    ends = np.stack([corner + along * t + normal * w for t in (first, last) for w in (-reach, reach)])
    rows, columns = picture.shape
    low, high = np.floor(ends.min(0)).astype(int), np.ceil(ends.max(0)).astype(int)
    if low.min() < 0 or high[0] >= columns or high[1] >= rows:
        return None
    X, Y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    x = np.stack([X.ravel(), Y.ravel()], -1) - corner
    t, d = x @ along, x @ normal
    inside = (t >= first) & (t <= last) & (np.abs(d) <= reach)
    if inside.sum() < EDGES.fewest:
        return None
    level = picture[low[1] : high[1] + 1, low[0] : high[0] + 1].ravel()[inside].astype(float)
    return _fitted(t[inside], d[inside], level, normal, along, reach, tone)


def _fitted(t: Array, d: Array, level: Array, normal: Array, along: Array, reach: float, tone: Tone) -> _Line | None:
    """Gauss-Newton for offset and slope of the line, both levels and the blur."""
    from scipy.special import ndtr  # most recordings show no tag, and its import takes as long as all others

    near = np.abs(d) > reach / 2
    if not (near & (d < 0)).any() or not (near & (d > 0)).any():
        return None
    dark, bright = float(np.median(level[near & (d < 0)])), float(np.median(level[near & (d > 0)]))
    if bright - dark <= 0:
        return None
    bent = tone.power != 1
    if bent:
        dark, bright = tone.light(dark), tone.light(bright)
    value = np.array([0.0, 0.0, dark, bright - dark, 0.7])
    damping, best = 1e-3, np.inf
    J = np.empty((len(t), 5))
    normal_matrix, r = np.eye(5), level

    def at(value: Array) -> tuple[Array, Array]:
        s = float(np.hypot(value[4], 1 / 12**0.5))  # a pixel averages over itself
        return (d - value[0] - value[1] * t) / s, np.full(1, s)

    def left(value: Array, z: Array) -> Array:
        if bent:
            return level - tone.level(value[2] + value[3] * ndtr(z))
        return np.asarray(level - value[2] - value[3] * ndtr(z))

    z, s = at(value)
    r = left(value, z)
    best = float(r @ r)
    for _ in range(EDGES.steps):
        density = value[3] * np.exp(-0.5 * z * z) / (2 * np.pi) ** 0.5
        J[:, 0] = -density / s
        J[:, 1] = J[:, 0] * t
        J[:, 2] = 1.0
        J[:, 3] = ndtr(z)
        J[:, 4] = -density * z / s * value[4] / s
        if bent:
            J *= tone.slope(value[2] + value[3] * ndtr(z))[:, None]
        normal_matrix = J.T @ J
        step = np.linalg.solve(normal_matrix + damping * np.diag(np.diag(normal_matrix)) + 1e-9 * np.eye(5), J.T @ r)
        trial = value + step
        trial[4] = np.clip(trial[4], 0.15, 3 * reach)
        z1, s1 = at(trial)
        r1 = left(trial, z1)
        cost = float(r1 @ r1)
        if cost > best:
            damping *= 10
            if damping > 1e3:
                break
            continue
        value, z, s, r, best, damping = trial, z1, s1, r1, cost, damping / 10
        if abs(step[0]) < 1e-4 and abs(step[1]) * t.max() < 1e-4:
            break
    if abs(value[0]) > reach or value[3] <= 0:
        return None
    variance = best / max(len(t) - 5, 1)
    covariance: Array = np.asarray(variance * np.linalg.pinv(normal_matrix)[:2, :2], float)
    contrast = float(value[3])
    if bent:
        contrast = float(np.ptp(tone.level(np.array([value[2], value[2] + value[3]]))))
    return _Line(normal, along, value[:2], covariance, float(value[4]), contrast, variance)


def _meet(corner: Array, one: _Line, two: _Line) -> tuple[Array, Array]:
    """Where two lines meet, px, and its sd (2,) in X and Y."""
    A = np.stack([line.normal - line.value[1] * line.along for line in (one, two)])
    det = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    if abs(det) < 0.05:
        return np.full(2, np.nan), np.full(2, np.nan)
    inverse = np.linalg.inv(A)
    x = inverse @ np.array([one.value[0], two.value[0]])
    variance = np.array(
        [np.array([1.0, line.along @ x]) @ line.covariance @ np.array([1.0, line.along @ x]) for line in (one, two)]
    )
    C = inverse @ np.diag(variance) @ inverse.T
    return corner + x, np.maximum(np.sqrt(np.diag(C)), EDGES.least_sd)
