"""A blob that two discs explain and no ellipse: two balls that touch or overlap, of which neither was seen alone.

The union of two alike discs of radius r, d apart, has the second moments lambda along and mu across their line of

    area = 4 int h,  lambda area = 4 int x^2 h,  mu area = 4/3 int h^3,   h(x) = sqrt(r^2 - (x - d/2)^2), x > 0

so that the blob's elongation (lambda - mu) / (lambda + mu) gives d / r, and its area r. From there both discs are
fitted together (`joint_fit`). An ellipse with the blob's own area and second moments is what a single thing seen
askew, or drawn out by motion, would show, and one disc fitted alike is what a ball shows whose picture has pixels that
are not square: where the two discs leave far less than either, and little at all, they are two. Half a disc, a streak
and a rectangle are described by none of these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.disc_fit import Float32
from vidtrack.tracking.discs.clump import Clump, allowed
from vidtrack.tracking.discs.joint_fit import JOINT_FIT


@dataclass(frozen=True)
class TwoDiscs:
    """When a blob is two discs.

    elongated   of (lambda - mu) / (lambda + mu), from which a blob is looked at: discs of 5 px radius whose middles are
                0.45 radii apart have it
    of_one      of what the ellipse leaves, or one disc, which the two leave at most
    apart       of their radius, that the middles are apart at least
    round       |log| of the ratio of a disc's axes, at most; alike: of the radii of both
    light       |log| of the ratio of their lights, at most
    """

    elongated: float = 0.12
    of_one: float = 0.5
    apart: float = 0.4
    round: float = 0.2
    alike: float = 0.7
    light: float = 0.7


TWO_DISCS = TwoDiscs()


class Pair(NamedTuple):
    """Two discs (2,): px as the window counts them; shape (SHAPE, 2), as `Joint` has it; background (2,) grey levels
    under each; measured: the fit says where each is, and not only that they are two.
    """

    x: Array
    y: Array
    shape: Array
    background: Array
    measured: bool


def two_discs(clump: Clump) -> Pair | None:
    """The two discs that a blob is; None where it is not plainly two."""
    if clump.long < TWO_DISCS.elongated or not clump.one_leaves:
        return None
    (xx, yy, xy), lines, middle = clump.moments, clump.lines, clump.middle
    apart, area = _union(clump.long)
    radius = float(np.sqrt(len(clump.pixels) * lines / area))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    step = 0.5 * apart * radius * np.array([np.cos(angle), np.sin(angle) / lines])
    at_x, at_y = middle[0] + step[0] * np.array([-1, 1]), middle[1] + step[1] * np.array([-1, 1])
    axes = np.log(np.array([[radius], [radius / lines]])) * np.ones(2)
    piece = clump.about(at_x, at_y, np.exp(axes))
    if clump.light(piece) <= 0:
        return None
    fit = clump.fitted(piece, at_x, at_y, axes)
    if not np.isfinite(fit.shape).all():
        return None
    if not fit.left < allowed(max(clump.noise, piece.noise), float(np.exp(fit.shape[2]).min())):
        return None
    between = np.hypot(*np.diff(fit.x), *(np.diff(fit.y) * lines))
    if between < TWO_DISCS.apart * float(np.exp(fit.shape[0].mean())):
        return None
    squashed = np.abs(fit.shape[0] - fit.shape[1] - np.log(lines))
    sizes, lights = (abs(float(np.diff(values)[0])) for values in (fit.shape[:2].mean(axis=0), fit.shape[2]))
    if squashed.max() > TWO_DISCS.round or sizes > TWO_DISCS.alike or lights > TWO_DISCS.light:
        return None
    second = np.array([[xx, xy / lines], [xy / lines, yy / lines**2]])
    shape, over = clump.grey.shape, piece.over
    near = _within(shape, fit.x, fit.y, np.exp(fit.shape[:2]) + JOINT_FIT.reach_px) & ~clump.hidden & ~piece.clipped
    ellipse = _ellipse(shape, float(middle[0]), float(middle[1]), second, float(np.exp(fit.shape[3]).mean()))
    scale = float((over[near] * ellipse[near]).sum() / max(float((ellipse[near] ** 2).sum()), 1e-9))
    of_ellipse = float(np.sqrt(np.square(over[near] - scale * ellipse[near]).mean()))
    if not fit.left < TWO_DISCS.of_one * min(of_ellipse, clump.one_leaves):
        return None
    return Pair(fit.x, fit.y, fit.shape, piece.background, fit.good)


@lru_cache(maxsize=1)
def _unions() -> tuple[Array, Array, Array]:
    """Elongations and areas of two discs of radius 1, so far apart."""
    apart = np.linspace(0.0, 2.0, 81)
    t = (np.arange(400) + 0.5) / 400
    x = t * (1 + apart[:, None] / 2)
    h = np.sqrt(np.maximum(1 - np.square(x - apart[:, None] / 2), 0.0))
    step = (1 + apart / 2) / 400
    area, along, across = (4 * (of * h).sum(axis=1) * step for of in (np.ones_like(x), x * x, h * h / 3))
    return (along - across) / (along + across), area, apart


def _union(long: float) -> tuple[float, float]:
    """How far apart two discs of radius 1 are whose union has this elongation, and its area."""
    elongations, area, apart = _unions()
    d = float(np.interp(long, elongations, apart))
    return d, float(np.interp(d, apart, area))


def _within(shape: tuple[int, ...], x: Array, y: Array, half: Array) -> Bools:
    row, column = np.ogrid[: shape[0], : shape[1]]
    out = np.zeros(shape, bool)
    for i in range(x.size):
        out |= (np.abs(column - x[i]) < half[0, i]) & (np.abs(row - y[i]) < half[1, i])
    return out


def _ellipse(shape: tuple[int, ...], x: float, y: float, second: Array, blur: float) -> Float32:
    """Share of each pixel that an ellipse with these second moments covers, its edge blurred by so many px."""
    from scipy.special import ndtr

    row, column = np.mgrid[: shape[0], : shape[1]]
    off = np.stack([column - x, row - y], axis=-1)
    rho = np.sqrt(np.einsum("...i,ij,...j->...", off, np.linalg.inv(second), off) / 4) + 1e-6
    radius = 2 * float(np.linalg.det(second)) ** 0.25
    return np.asarray(ndtr((1 - rho) * radius / np.hypot(blur, 0.29)), np.float32)
