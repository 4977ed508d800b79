"""The rim of a target beside its light: where a disc is cut, bumpy or lit on one side, the two have different middles.

From the centroid outwards, on rays in all directions, the rim is where the light has fallen half-way to the background.
Of anything that looks alike from two opposite sides (a disc, an ellipse, a square, a streak) the rim is at equal
distances on opposite rays: its odd harmonics are nought. Where something hides a part, at the waterline or behind a
board, where something bright of the background touches it, or where a mark reaches its edge, they are not:

    r(theta) = sum of r_k cos k theta + s_k sin k theta,    uneven = rms of k = 3, 5, 7 ...

What is left of such a disc is a part of a circle, and the longest part of the rim that is one has its middle where the
whole disc has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Picture
from vidtrack.tracking.centroiding.order_statistics import row_medians


@dataclass(frozen=True)
class Rim:
    """How a rim is looked at.

    rays, steps   directions, and places on each
    beyond        of the radius, and beyond_px besides: how far the rays go
    core, outside_px  of the radius: the middle, whose level is the target's; px beyond it where the background begins
    side, beside  of the radius: from where to where a side has its level; rays before and after one, of its side
    dimmest       of the usual contrast, that of each side at least: else it is not known where its edge is
    alike, sided  share of the target's unevenness from one side that its background has, and grey levels, at least,
                  where both are in one light
    least_px      radius of the smallest target that has a rim; largest_px: of the largest that is looked at
    level         grey levels of the middle over the background, at least
    grid          px, what the grid of pixels adds to the sd of a place of the rim where the light falls from all to
                  nothing within a px, with the power 3/2 of its slope; 8 times that in a field: of drawn discs of 2.5
                  to 20 px, edges blurred by 0 to 1.1 px
    coarse, fine  harmonics up to which, and from which on, a rim is compared: a part that is cut away is in the former,
                  noise, blocks of a codec and pixels made larger are in both alike
    arcs          shares of the rim, the largest that is a part of a circle counts
    round         sd of the rim that a part of a circle may leave; round_px, round_share: px and of the radius besides
    """

    rays: int = 32
    steps: int = 36
    beyond: float = 1.35
    beyond_px: float = 3.0
    core: float = 0.6
    outside_px: float = 2.0
    side: tuple[float, float] = (0.3, 0.75)
    beside: int = 2
    dimmest: float = 0.4
    alike: float = 0.4
    sided: float = 0.7
    least_px: float = 2.3
    largest_px: float = 40.0
    level: float = 8.0
    grid: float = 0.13
    coarse: int = 7
    fine: int = 9
    arcs: tuple[float, ...] = (0.75, 0.625, 0.5)
    round: float = 1.0
    round_px: float = 0.02
    round_share: float = 0.003


RIM = Rim()
_ANGLE = 2 * np.pi * np.arange(RIM.rays) / RIM.rays
_RAYS = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)])


class Looked(NamedTuple):
    """One look at n targets; NaN where it sees none.

    uneven  (n,) px; sd (n,) px, of a place of the rim, from the noise; rim (n, rays) px from the centroid
    edge    (n, rays) px from the centroid, where the light has fallen half-way from the level of the target on that
            side to that of the background beside it: light from one side does not move it
    sided   (n,) 1 where the background about it is lit from one side as it is itself, else 0: a shadow, no bright point
    shaped  (n,) rms of its coarse odd harmonics over that of its fine ones: 0.5 to 2 where chance makes them
    """

    uneven: Array
    sd: Array
    rim: Array
    edge: Array
    sided: Array
    shaped: Array


def look_at_rims(
    picture: Picture, at: Array, pixels: Array, noise: float, *, lines: int = 1, scale: float = 1.0
) -> Looked:
    """Look at bright targets at (n, 2) px, column and row of the sample, of so many pixels (n,).

    noise  grey levels, of a pixel; lines: 2 for a field; scale: grey levels 0-255 a unit of the picture
    """
    n = len(at)
    radius = np.sqrt(pixels * lines / np.pi)
    out = Looked(
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full((n, RIM.rays), np.nan),
        np.full((n, RIM.rays), np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
    )
    with np.errstate(invalid="ignore"):
        reach = RIM.beyond * radius + RIM.beyond_px
        able = np.isfinite(at).all(axis=1) & (radius >= RIM.least_px * lines) & (radius <= RIM.largest_px)
        size = np.array(picture.shape[::-1])
        spare = reach[:, None] / [1, lines]
        able &= ((at - spare >= 0) & (at + spare <= size - 1)).all(axis=1)
    if not (who := np.flatnonzero(able)).size:
        return out
    radius, reach, at = radius[who], reach[who], at[who]
    away = reach[:, None] * np.linspace(0, 1, RIM.steps)
    x, y = at.T[:, :, None, None] + _RAYS[:, None, :, None] * away[:, None] / np.array([1, lines])[:, None, None, None]
    grey = _levels(picture, x, y) * np.float32(scale)
    with np.errstate(invalid="ignore"):
        inside, outside = away < RIM.core * radius[:, None], away > (radius + RIM.outside_px)[:, None]
    top, ground = _middle(grey, inside), _middle(grey, outside)
    step, begin = (reach / (RIM.steps - 1))[:, None], away > RIM.core * radius[:, None]
    rim, fall = _falls_to(grey, ((top + ground) / 2)[:, None], begin, step)
    out.edge[who], out.sided[who] = _edge(grey, away / radius[:, None], outside, begin, step)
    waves = 2 * np.fft.rfft(rim, axis=1) / RIM.rays
    out.rim[who] = rim
    size2 = np.abs(waves) ** 2
    coarse, fine = size2[:, 3 : RIM.coarse + 1 : 2].sum(axis=1), size2[:, RIM.fine : -1].sum(axis=1)
    out.shaped[who] = np.sqrt(coarse / np.maximum(fine, 1e-12))
    out.uneven[who] = np.sqrt(size2[:, 3:-1:2].sum(axis=1) / 2)
    rise, slope = np.maximum(top - ground, 1e-3), row_medians(fall) / step[:, 0]
    sd = np.hypot(noise / slope, RIM.grid * lines**3 * (slope / rise) ** 1.5)
    out.sd[who] = np.where(top - ground >= RIM.level, sd, np.nan)
    return out


def _falls_to(grey: NDArray[np.float32], half: Array, begin: Bools, step: Array) -> tuple[Array, Array]:
    """Where light on rays (n, rays, steps) falls to levels (n, rays or 1), px (n, rays), and by how much a step there.

    begin  (n, steps) where on a ray it may; step: (n, 1) px from place to place
    """
    below = (grey < half[..., None]) & begin[:, None]
    last = np.clip(np.where(below.any(axis=2), np.argmax(below, axis=2), RIM.steps - 1) - 1, 0, None)[..., None]
    here = np.take_along_axis(grey, last, axis=2)[..., 0]
    fall = np.maximum(here - np.take_along_axis(grey, last + 1, axis=2)[..., 0], 1e-3)
    return step * (last[..., 0] + np.clip((here - half) / fall, 0, 1)), fall


def _edge(grey: NDArray[np.float32], share: Array, outside: Bools, begin: Bools, step: Array) -> tuple[Array, Array]:
    """`Looked.edge` (n, rays) px and `sided` (n,); share (n, steps) of the radius. Edges of targets with a side that
    hardly stands out are NaN.
    """
    inside = (share > RIM.side[0]) & (share < RIM.side[1])
    top, ground = (_of_sides(grey, where) for where in (inside, outside))
    edge, _ = _falls_to(grey, (top + ground) / 2, begin, step)
    edge[(top - ground).min(axis=1) < RIM.dimmest * row_medians(top - ground)] = np.nan
    of_top, of_ground = (2 / RIM.rays * np.hypot(*(_RAYS @ level.T)) for level in (top, ground))
    alike = of_ground * top.mean(axis=1) > RIM.alike * of_top * np.abs(ground.mean(axis=1))
    return edge, np.where(alike & (of_ground > RIM.sided), 1.0, 0.0)


def _of_sides(grey: NDArray[np.float32], where: Bools) -> Array:
    """Mean level of each ray (n, rays) and those beside it where steps (n, steps) are."""
    share = where / np.maximum(where.sum(axis=1, keepdims=True), 1)
    each = np.einsum("nrs,ns->nr", grey, share)
    turns = range(-RIM.beside, RIM.beside + 1)
    return np.asarray(sum(np.roll(each, k, axis=1) for k in turns) / len(turns), float)


def _levels(picture: Picture, x: Array, y: Array) -> NDArray[np.float32]:
    """Grey levels at places (n, rays, steps), between the pixels."""
    left, top = int(x.min()), int(y.min())
    right, bottom = int(x.max()) + 2, int(y.max()) + 2
    part = np.ascontiguousarray(picture[top:bottom, left:right], np.float32)
    flat = -1, x.shape[-1]
    xs, ys = ((v - first).astype(np.float32).reshape(flat) for v, first in ((x, left), (y, top)))
    grey = cv2.remap(part, xs, ys, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(grey, np.float32).reshape(x.shape)


def _middle(grey: NDArray[np.float32], where: Bools) -> Array:
    """Median (n,) over the rays of the mean level (n, rays, steps) where steps (n, steps) are."""
    share = where / np.maximum(where.sum(axis=1, keepdims=True), 1)
    return np.asarray(row_medians(np.einsum("nrs,ns->nr", grey, share)), float)


def middle_of_rim(rim: Array, sd: Array) -> tuple[Array, Array]:
    """The middle (2, n) px of each rim (n, rays) from the centroid, its first harmonic, and its sd (n,) px; sd: of a
    place of the rim.
    """
    return np.asarray(2 / RIM.rays * (_RAYS @ rim.T)), np.asarray(sd * np.sqrt(2 / RIM.rays))


def middle_of_arc(rim: Array, sd: Array) -> tuple[Array, Bools]:
    """The middle (2, n) px from the centroid of the circle that the longest part of each rim (n, rays) is of, and
    whether (n,) a part is a circle's within sd (n,) px. Kasa's fit: x^2 + y^2 = 2 a x + 2 b y + c.
    """
    x, y = rim * _RAYS[0], rim * _RAYS[1]
    size = np.maximum(rim.mean(axis=1), 1e-3)
    x, y = x / size[:, None], y / size[:, None]
    q = x * x + y * y
    one = np.ones_like(x)
    products = np.stack([x * x, x * y, x, y * y, y, one, x * q, y * q, q], axis=1)
    double = np.concatenate([np.zeros((*products.shape[:2], 1)), np.cumsum(np.tile(products, 2), axis=2)], axis=2)
    n, rays = rim.shape
    limit = RIM.round * sd + RIM.round_px + RIM.round_share * size
    middle, good, best = np.zeros((2, n)), np.zeros(n, bool), np.full(n, np.inf)
    for share in RIM.arcs:
        length = int(share * rays)
        sums = double[:, :, length : length + rays] - double[:, :, :rays]
        xx, xy, x1, yy, y1, n1, xq, yq, q1 = np.moveaxis(sums, 1, 0)
        matrix = np.stack([xx, xy, x1, xy, yy, y1, x1, y1, n1], axis=-1).reshape(n, rays, 3, 3) + 1e-9 * np.eye(3)
        a, b, c = np.moveaxis(np.linalg.solve(matrix, np.stack([xq, yq, q1], axis=-1)[..., None])[..., 0], -1, 0)
        a, b = a / 2, b / 2
        radius = np.sqrt(np.maximum(c + a * a + b * b, 0))
        off = np.hypot(x[:, None] - a[..., None], y[:, None] - b[..., None]) - radius[..., None]
        member = (np.arange(rays)[None] - np.arange(rays)[:, None]) % rays < length
        left = size[:, None] * np.sqrt((off**2 * member).sum(axis=2) / length)
        k = left.argmin(axis=1)
        least = left[np.arange(n), k]
        new = ~good & (least < best)
        middle[:, new] = (size * np.stack([a[np.arange(n), k], b[np.arange(n), k]]))[:, new]
        best[new] = least[new]
        good |= new & (least < limit)
    return middle, good
