"""A plane under each window: the background beneath a target, and how restless it is, all windows at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints, Picture
from vidtrack.tracking.centroiding.components import CUTTING


@dataclass(frozen=True)
class Surroundings:
    """How the background about a target is estimated.

    quantisation_sd  grey levels: the noise that rounding to whole levels leaves in any picture
    stands_out       sigmas above the background from which a pixel shows something
    row_step         of the rows that are used: at 2, a centroid's error of 0.009 px grows by 0.002 px
    slope_prior_px2  a slope of 0.1 grey levels/px is as unlikely as a pixel off by the noise
    """

    quantisation_sd: float = 12**-0.5
    stands_out: float = 4.5
    row_step: int = 2
    slope_prior_px2: float = 100.0

    @property
    def rows(self) -> slice:
        """The rows that are used."""
        return slice(0, None, self.row_step)


SURROUNDINGS = Surroundings()

_SQUARE7 = np.ones((7, 7), np.uint8)


class Sums:
    """Sums of x^l y^k over every window, x and y from the window's middle: two matrix products.

    In double precision, in which those of whole grey levels are exact: how a processor adds changes no answer.
    """

    def __init__(self, height: int, width: int) -> None:
        self.middle_x, self.middle_y = (width - 1) / 2, (height - 1) / 2
        x = np.arange(width + CUTTING.separator) - self.middle_x
        y = np.arange(height) - self.middle_y
        self.x = np.stack([np.ones_like(x), x, x * x], axis=1)
        self.y = np.stack([np.ones_like(y), y, y * y], axis=0)

    def moments(self, weight: NDArray[Any], rows: slice = slice(None)) -> Array:
        """(3, 3, n): [k, l] = sum of weight y^k x^l; weight (height, n, width), or only those rows of it."""
        height, n, width = weight.shape
        along = weight.astype(float).reshape(height * n, width) @ self.x
        sums = (self.y[:, rows] @ along.reshape(height, n * 3)).reshape(3, n, 3).transpose(0, 2, 1)
        return np.ascontiguousarray(sums)


sums_of = lru_cache(maxsize=64)(Sums)


class Plane(NamedTuple):
    slope: Array
    """(3, n) coefficients of 1, x, y from the window's middle, grey levels"""
    variance: Array
    """(2, n) of the coefficients of x and y, for a noise of one grey level"""
    noise: Array
    """(n,) grey levels, residual standard deviation"""
    unrest: Array
    """(n,) the same before pixels that stand off were left out"""
    tilt: Array
    """(3, n) by how much pixels that stand off would have moved the coefficients"""

    @property
    def value(self) -> Array:
        """(n,) grey level at the middle of the window"""
        return np.asarray(self.slope[0])


def background_plane(grey: Picture, mask: NDArray[np.uint8], sums: Sums, noise: float) -> Plane:
    """A plane under each window, fitted to the pixels more than three away from anything above the threshold.

    Where what it leaves is much more than the noise (a dim rope, a shadow), the pixels that stand off are dropped and
    the plane is fitted again.
    """
    height, n, width = grey.shape
    near = cv2.dilate(mask.reshape(height, n * width), _SQUARE7).reshape(grey.shape)[SURROUNDINGS.rows]
    outside = (near == 0).astype(np.float32)
    outside[..., width - CUTTING.separator :] = 0
    part = grey[SURROUNDINGS.rows]
    plane = plane_under(part, outside, sums)
    rough = plane.noise > 2 * max(noise, SURROUNDINGS.quantisation_sd)
    return _refitted(part, outside, sums, plane, np.flatnonzero(rough)) if rough.any() else plane


def _refitted(part: Picture, outside: NDArray[np.float32], sums: Sums, plane: Plane, rough: Ints) -> Plane:
    """The planes with those of some windows fitted again, without the pixels that stand off."""
    some, free = part[:, rough], outside[:, rough]
    fit = Plane(*(values[..., rough] for values in plane))
    for _ in range(3):
        off = np.abs(some - on_grid(fit.slope, sums, SURROUNDINGS.rows))
        fit = plane_under(some, free * (off < (2.0 * fit.noise.astype(np.float32))[:, None]), sums)
    tilt, unrest = plane.slope.copy(), plane.noise.copy()
    for values, better in zip(plane[:3], fit[:3], strict=True):
        values[..., rough] = better
    return plane._replace(tilt=plane.slope - tilt, unrest=unrest)


def on_grid(slope: Array, sums: Sums, rows: slice = slice(None)) -> NDArray[np.float32]:
    """The planes' grey levels at every pixel of (some rows of) their windows, (height, n, width)."""
    a, b, c = slope.astype(np.float32)[:, :, None]
    x, y = sums.x[:, 1].astype(np.float32), sums.y[1][rows, None, None].astype(np.float32)
    level: NDArray[np.float32] = (a + b * x) + c * y
    return level


def plane_under(grey: Picture, outside: NDArray[np.float32], sums: Sums) -> Plane:
    """Least squares of 1, x, y over the marked pixels; flat where there are too few to estimate a slope."""
    lit = outside * grey
    s, r = sums.moments(outside, SURROUNDINGS.rows), sums.moments(lit, SURROUNDINGS.rows)
    squares = (lit * grey).sum(axis=(0, 2), dtype=float)
    count = np.maximum(s[0, 0], 1e-6)
    mean, x, y = r[0, 0] / count, s[0, 1] / count, s[1, 0] / count
    # second moments about the middle of the marked pixels, with a gentle pull of the slope to zero
    xx, yy, xy = (
        s[0, 2] - s[0, 1] * x + SURROUNDINGS.slope_prior_px2,
        s[2, 0] - s[1, 0] * y + SURROUNDINGS.slope_prior_px2,
        s[1, 1] - s[0, 1] * y,
    )
    by_x, by_y = r[0, 1] - r[0, 0] * x, r[1, 0] - r[0, 0] * y
    determinant = xx * yy - xy * xy
    b, c = (yy * by_x - xy * by_y) / determinant, (xx * by_y - xy * by_x) / determinant
    left_over = squares - r[0, 0] * mean - b * by_x - c * by_y
    noise = np.sqrt(np.maximum(left_over, 0) / np.maximum(count - 3, 1))
    slope = np.stack([mean - b * x - c * y, b, c])
    noise = np.maximum(noise, SURROUNDINGS.quantisation_sd)
    return Plane(slope, np.stack([yy, xx]) / determinant, noise, noise, np.zeros_like(slope))
