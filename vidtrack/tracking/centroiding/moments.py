"""Centroids as moments of pixels, all windows at once: two matrix products, no loop over targets.

Equations: thesis 4.2.1 and 4.2.2 (binary); their intensity-weighted form (weighted).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints, Picture
from vidtrack.tracking.centroiding.background import Plane, Sums
from vidtrack.tracking.centroiding.components import CUTTING

_SQUARE3 = np.ones((3, 3), np.uint8)


def soft_edge(low: NDArray[np.uint8], target: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> NDArray[np.uint8]:
    """The target with its soft edge: grown twice through pixels that are `low` or more, then by one more.

    mask  everything above the threshold: pixels within two of what is not the target count for none. None: nothing else
    """
    shape, flat = target.shape, (target.shape[0], -1)
    region = target
    for _ in range(2):
        region = cv2.dilate(region.reshape(flat), _SQUARE3).reshape(shape)
        region &= low
    region = cv2.dilate(region.reshape(flat), _SQUARE3).reshape(shape)
    if mask is not None:
        others = mask & ~target & 1
        if others.any():
            near = cv2.dilate(others.reshape(flat), _SQUARE3, iterations=2).reshape(shape)
            region &= ~near | target
    region[..., -CUTTING.separator :] = 0
    return np.asarray(region, np.uint8)


def weighted(
    grey: Picture, region: NDArray[np.uint8], plane: Plane, sums: Sums
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array]:
    """x, y (from the window's middle), mass, sd_x, sd_y over the region, the plane taken off; its area, px^2; and the
    second moments of the light about x, y: xx, yy, xy, px^2.

    The noise of each pixel moves x by (x_i - x) / mass; an error of the plane's slope by sum(x_i^2) / mass.
    """
    weight = region.astype(np.float32)
    g, w = sums.moments(weight), sums.moments(weight * grey)
    a, b, c = plane.slope
    mass = w[0, 0] - a * g[0, 0] - b * g[0, 1] - c * g[1, 0]
    mass = np.where(mass > 0, mass, np.nan)
    x = (w[0, 1] - a * g[0, 1] - b * g[0, 2] - c * g[1, 1]) / mass
    y = (w[1, 0] - a * g[1, 0] - b * g[1, 1] - c * g[2, 0]) / mass
    across, down, slant = _about(g, x, y)
    level = a + b * x + c * y  # of the plane at x, y, about which the region is nearly symmetric
    of_region = (across, down, slant)
    spread = [(light - level * bare) / mass for light, bare in zip(_about(w, x, y), of_region, strict=True)]
    share = plane.noise / mass
    sd_x = share * np.sqrt(np.maximum(across, 0) + plane.variance[0] * across * across)
    sd_y = share * np.sqrt(np.maximum(down, 0) + plane.variance[1] * down * down)
    return x, y, mass, sd_x, sd_y, g[0, 0], *spread


def _about(sums: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Second moments about x, y (n,) of sums (3, 3, n): of x x, y y, x y."""
    xx = sums[0, 2] - (2 * sums[0, 1] - sums[0, 0] * x) * x
    yy = sums[2, 0] - (2 * sums[1, 0] - sums[0, 0] * y) * y
    return xx, yy, sums[1, 1] - x * sums[1, 0] - y * sums[0, 1] + x * y * sums[0, 0]


def binary(target: NDArray[np.uint8], sums: Sums) -> tuple[Array, Array, Array, Array]:
    """Mean x and y of the target's pixels (4.2.1, 4.2.2), and what counting whole pixels costs.

    A pixel on the rim is counted whole or not at all: an error of 1/12 px^2 in its area. The circle crosses 8 r
    pixels, sqrt(2) as many as the rim that erosion by a cross takes off, hence 1/8.
    """
    own = sums.moments(target)
    count = np.where(own[0, 0] > 0, own[0, 0], np.nan)
    x, y = own[0, 1] / count, own[1, 0] / count
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(target.reshape(target.shape[0], -1), cross).reshape(target.shape)
    rim = sums.moments(target - inner)
    spread_x = rim[0, 2] - 2 * x * rim[0, 1] + x * x * rim[0, 0]
    spread_y = rim[2, 0] - 2 * y * rim[1, 0] + y * y * rim[0, 0]
    return x, y, np.sqrt(spread_x / 8) / count, np.sqrt(spread_y / 8) / count


def plateau_of(grey: Picture, target: NDArray[np.uint8], plane: Plane, pixels: Ints) -> Array:
    """Mean grey level of the pixels above the threshold over the background, (n,)."""
    total = (grey * target).sum(axis=(0, 2), dtype=float)
    return np.asarray(total / np.maximum(pixels, 1) - plane.value, float)
