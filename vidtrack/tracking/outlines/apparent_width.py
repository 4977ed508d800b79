"""How wide balls look: the diameter of a disc of the level of a ball's middle that has as much light as the ball.

The light of a disc over the level of its middle is its area, however soft its edge is and wherever a threshold lies. So
the same ball looks alike to a hundredth of a pixel in a clip and in a run, in other light as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Bools, Picture


@dataclass(frozen=True)
class Rings:
    """Where a ball's light is looked for.

    least_px  radius of the smallest ball that has a middle; largest_px: of the largest
    core      of the radius: the middle, whose level is the ball's
    inner, flat  of the radius: its own middle, which may be brighter than all of it by this share; where it is by more
              the edge is so soft that it reaches the middle
    edge_px   beyond the radius: what the soft edge reaches; beyond it, to room_px, lies the background
    level     grey levels, of the middle over the background, at least
    full      grey level from which on a middle may be saturated
    uneven    of the level, what the background may vary by: more is something beside the ball
    """

    least_px: float = 2.5
    largest_px: float = 60.0
    core: float = 0.55
    inner: float = 0.3
    flat: float = 0.05
    edge_px: float = 2.5
    room_px: float = 5.0
    level: float = 20.0
    full: float = 250.0
    uneven: float = 0.25


RINGS = Rings()

AT_ONCE = 32
"""Balls that are looked at together: of thousands, each with its own window, memory would run out."""


def apparent_widths(picture: Picture, at: ArrayLike, pixels: ArrayLike, *, lines: int = 1, scale: float = 1.0) -> Array:
    """The apparent diameters (n,), px, of bright balls; NaN where one is small, saturated, at the edge, or not alone.

    picture   (rows, columns); scale: grey levels 0-255 a unit; lines: 2 for a field, whose rows lie 2 px apart
    at        (n, 2) px, column and row of the picture; pixels (n,) of it above a threshold
    """
    at, radius = np.asarray(at, float).reshape(-1, 2), np.sqrt(np.asarray(pixels, float) * lines / np.pi)
    out = np.full(len(at), np.nan)
    rows, columns = picture.shape
    with np.errstate(invalid="ignore"):
        able = np.isfinite(at).all(1) & (radius >= RINGS.least_px * lines) & (radius <= RINGS.largest_px)
    own = np.ceil((radius + RINGS.room_px)[:, None] / [1, lines])
    middle = np.rint(np.where(able[:, None], at, 0.0))
    able &= ((middle >= own) & (middle + own < [columns, rows])).all(1)
    ordered = np.flatnonzero(able)[np.argsort(radius[able], kind="stable")]
    for first in range(0, ordered.size, AT_ONCE):
        # those of one size together: windows are as wide as the largest needs
        some = ordered[first : first + AT_ONCE]
        (x, y), (wide, high) = middle[some].astype(np.intp).T, own[some[-1]].astype(np.intp)
        across, down = np.arange(-wide, wide + 1), np.arange(-high, high + 1)
        column = np.clip(x[:, None] + across, 0, columns - 1)  # what lies beyond is no ball's own
        row = np.clip(y[:, None] + down, 0, rows - 1)
        grey = picture[row[:, :, None], column[:, None]] * np.float32(scale)
        dx = across - (at[some, 0] - x)[:, None]
        dy = lines * (down - (at[some, 1] - y)[:, None])
        d = np.sqrt(dx[:, None] ** 2 + dy[:, :, None] ** 2)
        out[some] = _widths(grey, d, radius[some, None, None], lines)
    return out


def _widths(grey: Array, d: Array, radius: Array, lines: int) -> Array:
    """Of balls (n,), by grey levels and distances (n, rows, columns) from their centroids; radius (n, 1, 1) px."""
    inside = d < radius + RINGS.edge_px
    around = (d < radius + RINGS.room_px) & ~inside
    ground = _mean(grey, around)
    over = grey - ground[:, None, None]
    level = _mean(over, d < np.maximum(RINGS.core * radius, lines))
    inner = _mean(over, d < np.maximum(RINGS.inner * radius, lines))
    beside = np.abs(over * around).max((1, 2), initial=0.0)
    alone = (level >= RINGS.level) & (level + ground <= RINGS.full) & (beside <= RINGS.uneven * level)
    area = lines * (over * inside).sum((1, 2)) / np.where(alone, level, 1.0)
    good = alone & (inner <= (1 + RINGS.flat) * level) & (area > 0)
    return np.asarray(np.where(good, 2 * np.sqrt(np.where(good, area, 1.0) / np.pi), np.nan), float)


def _mean(grey: Array, where: Bools) -> Array:
    """The mean (n,) of some pixels of each window."""
    return np.asarray((grey * where).sum((1, 2)) / np.maximum(where.sum((1, 2)), 1))
