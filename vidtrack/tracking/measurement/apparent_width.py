"""How wide balls look: the diameter of a disc of the level of a ball's middle that has as much light as the ball.

The light of a disc over the level of its middle is its area, however soft its edge is and wherever a threshold lies. So
the same ball looks alike to a hundredth of a pixel in a clip and in a run, in other light as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Picture


@dataclass(frozen=True)
class Rings:
    """Where a ball's light is looked for.

    least_px  radius of the smallest ball that has a middle
    core      of the radius: the middle, whose level is the ball's
    inner, flat  of the radius: its own middle, which may be brighter than all of it by this share; where it is by more
              the edge is so soft that it reaches the middle
    edge_px   beyond the radius: what the soft edge reaches; beyond it, to room_px, lies the background
    level     grey levels, of the middle over the background, at least
    full      grey level from which on a middle may be saturated
    uneven    of the level, what the background may vary by: more is something beside the ball
    """

    least_px: float = 2.5
    core: float = 0.55
    inner: float = 0.3
    flat: float = 0.05
    edge_px: float = 2.5
    room_px: float = 5.0
    level: float = 20.0
    full: float = 250.0
    uneven: float = 0.25


RINGS = Rings()


def apparent_widths(picture: Picture, at: ArrayLike, pixels: ArrayLike, *, lines: int = 1, scale: float = 1.0) -> Array:
    """The apparent diameters (n,), px, of bright balls; NaN where one is small, saturated, at the edge, or not alone.

    picture   (rows, columns); scale: grey levels 0-255 a unit; lines: 2 for a field, whose rows lie 2 px apart
    at        (n, 2) px, column and row of the picture; pixels (n,) of it above a threshold
    """
    at, radius = np.asarray(at, float).reshape(-1, 2), np.sqrt(np.asarray(pixels, float) * lines / np.pi)
    out = np.full(len(at), np.nan)
    rows, columns = picture.shape
    with np.errstate(invalid="ignore"):
        able = np.isfinite(at).all(1) & (radius >= RINGS.least_px * lines)
    for i in np.flatnonzero(able).tolist():
        reach = radius[i] + RINGS.room_px
        wide, high = int(np.ceil(reach)), int(np.ceil(reach / lines))
        x, y = round(at[i, 0]), round(at[i, 1])
        if x < wide or y < high or x + wide >= columns or y + high >= rows:
            continue
        grey = picture[y - high : y + high + 1, x - wide : x + wide + 1] * float(scale)
        dy = lines * (np.arange(-high, high + 1) - (at[i, 1] - y))
        d = np.hypot(np.arange(-wide, wide + 1) - (at[i, 0] - x), dy[:, None])
        out[i] = _width(grey, d, radius[i], lines)
    return out


def _width(grey: Array, d: Array, radius: float, lines: int) -> float:
    """Of one ball, by grey levels and distances (rows, columns) from its centroid."""
    inside = d < radius + RINGS.edge_px
    around = grey[~inside & (d < radius + RINGS.room_px)]
    core = grey[d < max(RINGS.core * radius, lines)]
    if not around.size or not core.size:
        return float("nan")
    ground, top = float(np.median(around)), float(core.mean())
    level = top - ground
    if level < RINGS.level or top > RINGS.full or np.abs(around - ground).max() > RINGS.uneven * level:
        return float("nan")
    inner = grey[d < max(RINGS.inner * radius, lines)]
    if inner.size and float(inner.mean()) - ground > (1 + RINGS.flat) * level:
        return float("nan")
    area = lines * float((grey[inside] - ground).sum()) / level
    return 2 * float(np.sqrt(max(area, 0.0) / np.pi))
