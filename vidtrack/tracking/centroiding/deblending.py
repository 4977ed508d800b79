"""Centroids of targets beside which something else is bright: another target, a rope, a metre stick.

Light of a neighbour within a target's soft edge pulls a weighted centroid to it; leaving out the pixels of that side
pushes it away. So a soft-edged disc is fitted to what is left once all pixels near the neighbour are left out: the
rim that remains gives the middle, and the fit's covariance says how well.

What is a neighbour: all that stands out of the background by 4.5 sigma more than two px beyond the target's outline,
whatever lies above the target's own threshold but is not it, and what is dark (`dark_neighbours`). All windows at once,
as in `centroid`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.centroiding.background import SURROUNDINGS, Plane, Sums, on_grid, plane_under
from vidtrack.tracking.centroiding.components import CUTTING
from vidtrack.tracking.centroiding.dark_neighbours import Dark, one_sided, plane_of_most
from vidtrack.tracking.centroiding.disc_fit import fit_soft_discs
from vidtrack.tracking.centroiding.moments import soft_edge, weighted

Bytes = NDArray[np.uint8]
Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class Deblending:
    """What is a neighbour of a target, and what its own blur.

    halo  share of a target's surroundings above which what is bright there is its own blur
    """

    halo: float = 0.5


DEBLENDING = Deblending()

_SQUARE2 = np.ones((2, 2), np.uint8)
_SQUARE3 = np.ones((3, 3), np.uint8)
_ROUND5, _ROUND7 = (cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.uint8) for side in (5, 7))


class Beside(NamedTuple):
    """Targets (n,) and their backgrounds; NaN where a target cannot be measured.

    x, y (px from the window's middle), mass (grey levels, summed), sd_x, sd_y (px), area (px^2 that was counted);
    slope to tilt as in the plane of `centroid`
    """

    x: Array
    y: Array
    mass: Array
    sd_x: Array
    sd_y: Array
    area: Array
    xx: Array
    yy: Array
    xy: Array
    slope: Array
    variance: Array
    noise: Array
    unrest: Array
    tilt: Array


def crowded(low: Bytes, target: Bytes, others: Bytes | None) -> Ints:
    """Windows in which something bright is not the target; arguments as those of `bright_neighbours`."""
    beyond = low & ~_grown(target, _ROUND5)
    if others is not None:
        beyond |= others
    some = np.flatnonzero(np.bitwise_or.reduce(beyond, axis=0).any(axis=1))
    if not some.size:
        return some
    neighbours = bright_neighbours(low[:, some], target[:, some], None if others is None else others[:, some])
    return some[neighbours.any(axis=(0, 2))]


def measure_beside(
    grey: Float32,
    target: Bytes,
    mask: Bytes,
    who: Ints,
    sums: Sums,
    *,
    rise: Array,
    pixels: Ints,
    noise: float,
    always_fitted: bool,
    dark: Dark,
) -> tuple[Ints, Beside]:
    """Measure targets without what their neighbours light; returns whose they are of `who`, the rest being alone.

    grey    (height, n, width) grey levels; target: 1 on the target; mask: 1 above the threshold
    who     windows that may be crowded; rise (n,) grey levels from the background to the threshold
    pixels  (n,) above the threshold; noise: grey levels, of a pixel
    always_fitted  whether a disc is fitted also to targets that nothing comes near
    dark    what is dark beside them
    """
    free = (_grown(mask[:, who], _ROUND7) == 0).astype(np.float32)
    free[..., -CUTTING.separator :] = 0
    plane, scatter = _steady(grey[:, who], free, sums, noise)
    dark = dark.of(who)
    if (own := dark.who).size:
        most, scatter[own], _ = plane_of_most(grey[:, who[own]], free[:, own].astype(np.uint8), sums, noise)
        for values, better in zip(plane, most, strict=True):
            values[..., own] = better
    low = _above(grey[:, who], plane, SURROUNDINGS.stands_out * scatter, sums)
    low[:, own] = one_sided(low[:, own], target[:, who[own]])
    neighbours = bright_neighbours(low, target[:, who], (mask & ~target)[:, who])
    not_halo = np.asarray(bright_neighbours(dark.cover, target[:, who], None).any(axis=(0, 2)))
    cover = dark.cover * not_halo[:, None]
    crowd = np.flatnonzero((neighbours | cover).any(axis=(0, 2)))
    who, neighbours, free, cover = who[crowd], neighbours[:, crowd], free[:, crowd], cover[:, crowd]
    if not who.size:
        return who, Beside._make([np.empty(0)] * len(Beside._fields))
    grey, target, others = grey[:, who], target[:, who], (mask & ~target)[:, who]
    hidden = lit(neighbours, others) | _grown(cover, _ROUND7)
    neighbours |= cover
    plane = plane_under(grey[SURROUNDINGS.rows], (free * (hidden == 0))[SURROUNDINGS.rows], sums)
    region = soft_edge(
        _above(grey, plane, np.maximum(SURROUNDINGS.stands_out * noise, 0.1 * rise[who]), sums), target, None
    )
    beside = Beside._make([*np.stack(weighted(grey, region, plane, sums)), *plane])
    near = np.flatnonzero((region & _grown(neighbours, _ROUND5)).any(axis=(0, 2)))
    if always_fitted:
        near = np.arange(who.size)
    if near.size:
        fitted = _fitted(
            (grey - on_grid(plane.slope, sums))[:, near],
            target[:, near],
            hidden[:, near],
            grey[:, near] >= CUTTING.full_scale,
            sums,
            pixels[who[near]],
            plane.noise[near],
        )
        area = _area(region[:, near], target[:, near], hidden[:, near])
        again = dict(zip(("x", "y", "mass", "sd_x", "sd_y"), fitted, strict=True)) | {"area": area}
        for name, value in (again | dict.fromkeys(("xx", "yy", "xy"), np.nan)).items():
            getattr(beside, name)[near] = value
    return who, beside


def _steady(grey: Float32, free: Float32, sums: Sums, noise: float) -> tuple[Plane, Array]:
    """A plane under the marked pixels that does not follow what is brighter, and how far pixels scatter about it, (n,).

    It begins flat, at the level of the darkest fifth, and takes in from round to round what lies within its scatter.
    """
    few, marked = grey[SURROUNDINGS.rows], free[SURROUNDINGS.rows]
    something = np.bitwise_or.reduce(marked > 0, axis=(0, 2))
    marked = np.where(something[:, None], marked, np.float32(1))
    dark, base = np.nan_to_num(np.nanquantile(np.where(marked > 0, few, np.nan), [0.05, 0.2], axis=(0, 2)))
    # 0.8 sigma lie between those quantiles
    scatter = np.maximum((base - dark) / 0.8, max(noise, SURROUNDINGS.quantisation_sd))
    off = few - base.astype(np.float32)[:, None]
    for _ in range(5):
        weight = marked * (np.abs(off) < (3.5 * scatter).astype(np.float32)[:, None])
        plane = plane_under(few, weight, sums)
        off = few - on_grid(plane.slope, sums, SURROUNDINGS.rows)
    return plane, scatter


def _above(grey: Float32, plane: Plane, level: Array, sums: Sums) -> Bytes:
    """1 where windows are more than `level` (n,) above their planes."""
    low = np.zeros(grey.shape, np.uint8)
    low[grey - on_grid(plane.slope, sums) > level.astype(np.float32)[:, None]] = 1
    low[..., -CUTTING.separator :] = 0
    return low


def bright_neighbours(low: Bytes, target: Bytes, others: Bytes | None) -> Bytes:
    """1 where something bright is not the target, (height, n, width).

    low     1 where a pixel stands out of the background; target: 1 on it
    others  1 on patches above the target's threshold that are not the target; None: there are none
    Specks of less than 2 x 2 px are noise; what surrounds most of the target is its own blur.
    """
    own = _grown(target, _ROUND5)
    beyond = low & ~own
    beyond = cv2.morphologyEx(beyond.reshape(len(low), -1), cv2.MORPH_OPEN, _SQUARE2).reshape(low.shape)
    rim = _grown(own, _SQUARE3) & ~own
    own_blur = _count(rim & beyond) > DEBLENDING.halo * _count(rim)
    beyond[:, own_blur] = 0
    return np.asarray(beyond if others is None else beyond | others, np.uint8)


def lit(neighbours: Bytes, others: Bytes) -> Bytes:
    """1 where neighbours may have lit a pixel: within 2 px of those with a known outline, within 3 px of the rest."""
    near = _grown(others, _ROUND5)
    return near | _grown(neighbours & ~near, _ROUND7)


def _fitted(
    data: Float32, target: Bytes, hidden: Bytes, clipped: NDArray[Any], sums: Sums, pixels: Ints, noise: Array
) -> Array:
    """x, y, mass, sd_x, sd_y (5, n) of a soft-edged disc fitted to each target, without the pixels that are hidden."""
    near = _grown(target, _ROUND7)
    near[..., -CUTTING.separator :] = 0
    own = sums.moments(target)
    light = (data * target).sum(axis=(0, 2), dtype=float)
    count = np.maximum(own[0, 0], 1)
    fit = fit_soft_discs(
        data,
        near & ~hidden & 1,
        clipped,
        middle=(sums.middle_x, sums.middle_y),
        x=own[0, 1] / count,
        y=own[1, 0] / count,
        radius=np.sqrt(np.maximum(pixels, 1) / np.pi),
        contrast=light / count,
        noise=noise,
    )
    return np.stack([fit.x, fit.y, fit.mass, fit.sd_x, fit.sd_y])


def _area(region: Bytes, target: Bytes, hidden: Bytes) -> Array:
    """px^2 of each target with its soft edge, what is hidden of the edge taken to be like the rest of it, (n,)."""
    rim = _grown(target, _SQUARE3) & ~target
    free = _count(rim & ~hidden)
    edge = _count(region & ~target & ~hidden) / np.maximum(free, 1) * _count(rim)
    return np.asarray(_count(target) + np.where(free > 0, edge, np.nan))


def _grown(marked: Bytes, by: Bytes) -> Bytes:
    """Marks (height, n, width) dilated by a mask."""
    return np.asarray(cv2.dilate(marked.reshape(len(marked), -1), by).reshape(marked.shape), np.uint8)


def _count(marked: Bytes) -> Array:
    """Pixels marked in each window, (n,)."""
    return np.asarray(marked.sum(axis=(0, 2), dtype=np.intp), float)
