"""The centroid of one target in each window: moments, or a fitted disc where something bright is beside it.

Only the component that belongs to the target counts: a neighbour in the window, and the pixels that its soft edge
reaches, are left out. The background is a plane fitted to the window outside of everything bright.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture
from vidtrack.tracking.centroiding.background import (
    SURROUNDINGS,
    Plane,
    Sums,
    background_plane,
    on_grid,
    sums_of,
)
from vidtrack.tracking.centroiding.components import CUTTING, Components, Windows, above, own_pixels
from vidtrack.tracking.centroiding.dark_neighbours import dark_beside
from vidtrack.tracking.centroiding.deblending import crowded, measure_beside
from vidtrack.tracking.centroiding.disc_fit import fit_soft_discs
from vidtrack.tracking.centroiding.moments import binary, plateau_of, soft_edge, weighted
from vidtrack.tracking.centroiding.surface import surface_shift
from vidtrack.tracking.detect_settings import Kind

_SQUARE3 = np.ones((3, 3), np.uint8)


class Centroids(NamedTuple):
    """One row a window; NaN (0, False) where no component was chosen.

    x, y           px in the picture; sd_x, sd_y px, one standard deviation from noise, contrast and background
    pixels         pixels above the threshold; mass: grey levels above the background, summed
    contrast       grey levels, mean of the target above the background; background: grey level under the target
    plateau        grey levels, mean of the pixels above the threshold over the background: unlike the contrast, to
                   which the light of the soft edge adds, never more than the peak, however few pixels there are
    noise          grey levels, what the background plane leaves; unrest: the same with all that stands off in it
    soft           px, how far the target's soft edge reaches beyond the threshold
    pull           px by which things in the background would have moved x or y, had they not been left out
    saturated      at least a twentieth of the target is at full scale
    xx, yy, xy     px^2, second moments of its light; NaN where a disc was fitted beside something bright
    shift          (2, m) px of the first m windows, by what its surface moves it (`surface`)
    """

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    pixels: Ints
    mass: Array
    contrast: Array
    plateau: Array
    background: Array
    noise: Array
    unrest: Array
    soft: Array
    pull: Array
    saturated: Bools
    xx: Array
    yy: Array
    xy: Array
    shift: Array


def measure(
    windows: Windows,
    found: Components,
    chosen: Ints,
    *,
    noise: float,
    kind: Kind = "weighted",
    threshold: ArrayLike | None = None,
    surfaces: int = 0,
) -> Centroids:
    """The centroid of one component in each window.

    windows, found  from `components`
    chosen          (n,) index of the target's component (a row of `found`), -1 for none: its row is NaN
    noise           grey levels, standard deviation of a pixel; sets how far down the soft edge is followed
    kind            weighted: sum(w x) / sum(w), w the intensity above the background over the target and its soft edge;
                    binary: mean x of the pixels above the threshold (4.2.1, 4.2.2);
                    ellipse: a soft-edged elliptical disc is fitted, for targets that are tiny or saturated
    threshold       grey levels, as given to `components`; not known: taken to be half-way up the target
    surfaces        of so many windows the surface is looked at
    """
    height, n, width = windows.raw.shape
    grey = np.zeros((height, n, width + CUTTING.separator), np.float32)
    np.multiply(windows.raw, np.float32(windows.scale), out=grey[..., :width])
    none = chosen < 0
    alone = found.window.size == n and not none.any()
    target = found.mask if alone else own_pixels(found, chosen)
    pixels = found.pixels[chosen] * ~none if found.pixels.size else np.zeros(n, np.intp)
    sums = sums_of(height, width)
    plane = background_plane(grey, found.mask, sums, noise)
    plateau = plateau_of(grey, target, plane, pixels)
    rise = 0.5 * plateau if threshold is None else np.asarray(threshold) - plane.value
    level = plane.value + np.maximum(SURROUNDINGS.stands_out * noise, 0.1 * rise)
    low = _low(windows, level, target.shape)
    region = soft_edge(low, target, None if alone else found.mask)
    x, y, mass, sd_x, sd_y, area, xx, yy, xy = weighted(grey, region, plane, sums)
    level_of = (rise + plane.value)[:surfaces]
    shift = surface_shift(grey, region, plane, sums, level_of, np.stack([x, y]), mass)
    contrast = mass / np.where(pixels > 0, pixels, np.nan)
    if kind == "binary":
        x, y, sd_x, sd_y = binary(target, sums)
    elif kind == "ellipse":
        x, y, sd_x, sd_y = _ellipse(grey, region, plane, sums, contrast, pixels, x, y)
    if kind != "binary":
        who = crowded(low, target, None if alone else found.mask & ~target)
        dark = dark_beside(grey, found.mask, plane, sums, noise, 2 * rise)
        who = np.union1d(who, dark.who)
        if (who := who[pixels[who] > 0]).size:
            windows_of = grey, target, found.mask, who, sums
            fitted = kind == "ellipse"
            who, beside = measure_beside(
                *windows_of, rise=rise, pixels=pixels, noise=noise, always_fitted=fitted, dark=dark
            )
            plateau += plane.value
            for values, better in zip((x, y, mass, sd_x, sd_y, area, xx, yy, xy, *plane), beside, strict=True):
                values[..., who] = better
            plateau -= plane.value
            shift[:, who[who < surfaces]] = np.nan
            contrast = mass / np.where(pixels > 0, pixels, np.nan)
    if not alone:
        for values in (x, y, sd_x, sd_y, mass):
            values[none] = np.nan
    return Centroids(
        x + windows.left + sums.middle_x,
        y + windows.top + sums.middle_y,
        sd_x,
        sd_y,
        pixels,
        mass,
        contrast,
        plateau,
        plane.value,
        plane.noise,
        plane.unrest,
        np.sqrt(area / np.pi) - np.sqrt(pixels / np.pi),
        np.abs(plane.tilt[1:]).max(axis=0) * area * area / (4 * np.pi) / mass,  # sum of x^2 over a disc, over the mass
        _saturated(windows, target, pixels),
        xx,
        yy,
        xy,
        shift,
    )


def _low(windows: Windows, level: Array, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """1 where pixels are above `level` (n,), in an array of this shape."""
    low = np.zeros(shape, np.uint8)
    low[..., : windows.raw.shape[2]] = above(windows, level)
    return low


def _ellipse(
    grey: Picture,
    region: NDArray[np.uint8],
    plane: Plane,
    sums: Sums,
    contrast: Array,
    pixels: Ints,
    x: Array,
    y: Array,
) -> tuple[Array, Array, Array, Array]:
    """x, y, sd_x, sd_y of a soft-edged elliptical disc; pixels at full scale only bound it from below."""
    wider = cv2.dilate(region.reshape(grey.shape[0], -1), _SQUARE3).reshape(grey.shape)
    wider[..., -CUTTING.separator :] = 0
    fit = fit_soft_discs(
        grey - on_grid(plane.slope, sums),
        wider,
        grey >= CUTTING.full_scale,
        middle=(sums.middle_x, sums.middle_y),
        x=x,
        y=y,
        radius=np.sqrt(np.maximum(pixels, 1) / np.pi),
        contrast=contrast,
        noise=plane.noise,
    )
    return fit.x, fit.y, fit.sd_x, fit.sd_y


def _saturated(windows: Windows, target: NDArray[np.uint8], pixels: Ints) -> Bools:
    """Whether at least a twentieth of each target is at full scale."""
    if windows.raw.size == 0 or windows.raw.max() * windows.scale < CUTTING.full_scale:
        return np.zeros(pixels.size, bool)
    full = (windows.raw >= CUTTING.full_scale / windows.scale) & (target[..., : windows.raw.shape[2]] > 0)
    enough: Bools = full.sum(axis=(0, 2)) * 20 >= np.maximum(pixels, 1)
    return enough
