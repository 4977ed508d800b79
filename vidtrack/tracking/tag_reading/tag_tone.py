"""How grey levels follow light, from coded tags: a camera's gamma shifts the edges of black and white apart.

Levels that are a power of light widen white and narrow black. The outer edges of a tag then lie inwards, those of the
white squares in it outwards: a tag drawn from its measured corners shows the one against the other, and fits best with
the power that the camera has. One edge alone does not show it: a shifted edge looks the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.tracking.tag_reading.tag_corners import Tone, tag_corners


class ToneSettings(NamedTuple):
    """How the power is found."""

    powers: tuple[float, ...] = (1.0, 1 / 1.4, 1 / 1.8, 1 / 2.2, 1 / 2.6)
    fewest_px: float = 4.0
    """A module, from which black and white squares are seen apart."""
    least_levels: float = 20.0
    """Between black and white."""
    least_gamma: float = 1.05
    """Below it levels are taken for proportional to light: corners move by less than 0.02 px."""


SETTINGS = ToneSettings()


def misfits(picture: NDArray[np.generic], rough: Array, modules: int, top: float) -> Array | None:
    """How badly the tag as a whole fits with each of the powers: mean squares, grey levels; None where it says nothing.

    rough, modules  as for `tag_corners`; top: the largest level that the recording can hold
    """
    side = float(np.linalg.norm(np.roll(rough, -1, 0) - rough, axis=-1).min())
    if side < SETTINGS.fewest_px * modules:
        return None
    out = []
    for power in SETTINGS.powers:
        tone = Tone(power, top)
        own = tag_corners(picture, rough, modules, tone)
        if not np.isfinite(own.b).all() or own.contrast < SETTINGS.least_levels * top / 255:
            return None
        out.append(_misfit(picture, own.b, modules, own.blur, tone))
    return np.array(out) if np.isfinite(out).all() else None


def tone_of(each: Sequence[Array], top: float) -> Tone:
    """The tone that misfits of several sightings show: by a parabola through the best power and those beside it.

    Levels are taken for proportional to light where that fits best, or there are none.
    """
    if not len(each):
        return Tone(1.0, top)
    mean = np.exp(np.median(np.log(np.array(each)), 0))
    gamma, k = 1 / np.array(SETTINGS.powers), int(mean.argmin())
    if k in (0, len(mean) - 1):
        return Tone(SETTINGS.powers[k], top)
    before, least, after = mean[k - 1 : k + 2]
    found = gamma[k] + (gamma[k + 1] - gamma[k]) * (before - after) / (2 * (before - 2 * least + after))
    return Tone(1 / float(found), top) if found > SETTINGS.least_gamma else Tone(1.0, top)


def _misfit(picture: NDArray[np.generic], b: Array, modules: int, blur: float, tone: Tone) -> float:
    """Mean square of the levels within the tag less those of the tag as drawn from its corners."""
    low, high = np.floor(b.min(0)).astype(int), np.ceil(b.max(0)).astype(int) + 1
    if (low < 0).any() or high[0] > picture.shape[1] or high[1] > picture.shape[0]:
        return float("nan")
    X, Y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    level = picture[low[1] : high[1], low[0] : high[0]].astype(float).ravel()
    u, v = _in_modules(b, modules, np.stack([X.ravel(), Y.ravel()], -1).astype(float))
    inside = (u > 0.5) & (u < modules - 0.5) & (v > 0.5) & (v < modules - 0.5)
    u, v, level = u[inside], v[inside], level[inside]
    light = tone.top * np.maximum(level / tone.top, 1e-4) ** (1 / tone.power)
    cell = (np.floor(v).astype(int), np.floor(u).astype(int))
    middle = (np.abs(u % 1 - 0.5) < 0.25) & (np.abs(v % 1 - 0.5) < 0.25)
    total, count = np.zeros((modules, modules)), np.zeros((modules, modules))
    np.add.at(total, (cell[0][middle], cell[1][middle]), light[middle])
    np.add.at(count, (cell[0][middle], cell[1][middle]), 1.0)
    with np.errstate(invalid="ignore"):
        seen = total / count
    if not np.isfinite(seen[1:-1, 1:-1]).all():
        return float("nan")
    black, white = np.nanmin(seen[1:-1, 1:-1]), np.nanmax(seen[1:-1, 1:-1])
    bits = np.where(np.isfinite(seen), seen > (black + white) / 2, False).astype(float)
    bits[[0, -1]], bits[:, [0, -1]] = 0.0, 0.0
    sides = np.linalg.norm(np.roll(b, -1, 0) - b, axis=-1)
    widths = [np.hypot(blur, 1 / 12**0.5) * modules / own for own in (sides[[0, 2]].mean(), sides[[1, 3]].mean())]
    share = [_shares(own, modules, width) for own, width in zip((u, v), widths, strict=True)]
    drawn = np.einsum("ni,ij,nj->n", share[1], bits, share[0])
    A = np.stack([1 - drawn, drawn], -1)
    shades = np.maximum(np.linalg.lstsq(A, light)[0], 0.0)
    return float(np.mean((level - tone.level(A @ shades)) ** 2))


def _in_modules(b: Array, modules: int, px: Array) -> tuple[Array, Array]:
    """Where pixels (n, 2) lie in the tag, modules from its upper left corner: by the homography of its corners."""
    at = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float) * modules
    rows = []
    for (x, y), (u, v) in zip(b - b.mean(0), at, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    H = np.append(np.linalg.solve(np.array(rows), at.ravel()), 1.0).reshape(3, 3)
    found = np.column_stack([px - b.mean(0), np.ones(len(px))]) @ H.T
    return found[:, 0] / found[:, 2], found[:, 1] / found[:, 2]


def _shares(at: Array, modules: int, width: float) -> Array:
    """Share (n, modules) of each column of squares in what is seen at places (n,), blurred by `width` modules."""
    from scipy.special import ndtr  # most recordings show no tag

    edges = ndtr((at[:, None] - np.arange(modules + 1)) / width)
    return np.asarray(edges[:, :-1] - edges[:, 1:])
