"""Centroids of targets in small windows cut from a picture, all windows at once.

A window is a rectangle about one target. All windows lie side by side in one array (height, n, width), which is
also one wide picture: thresholding, connected components and dilation run over all of them in one call, and the
sums of the centroid are two matrix products. Nothing here loops over targets.

Only the component that belongs to the target counts: a neighbour in the window, and the pixels that its soft edge
reaches, are left out. The background is a plane fitted to the window outside of everything bright.
Windows speak grey levels 0-255 whatever the depth of the video; x and y are px in the picture that was cut.
Equations: thesis 4.2.1 and 4.2.2 (binary); their intensity-weighted form (weighted).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture

Kind = Literal["weighted", "binary", "ellipse"]

SEPARATOR = 3
"""Empty columns between windows: the soft edge grows by three pixels and must not reach the next window."""
QUANTISATION_SD = 12**-0.5
"""Grey levels: the noise that rounding to whole levels leaves in any picture."""
FULL_SCALE = 254.5
"""Grey levels: a pixel this bright may be brighter than the camera could tell."""
_SQUARE3 = np.ones((3, 3), np.uint8)
_SQUARE7 = np.ones((7, 7), np.uint8)


class Windows(NamedTuple):
    """Rectangles cut from one or several pictures.

    raw    (height, n, width) stored values, brighter = target
    left   (n,), top (n,) px, the picture's column and row of the window's first pixel
    scale  grey levels a stored value: 1 for 8 bit, 255/1023 for 10 bit
    """

    raw: Picture
    left: Ints
    top: Ints
    scale: float


class Components(NamedTuple):
    """Connected bright patches: one row a component, from label 1.

    mask, labels   (height, n, width + SEPARATOR), 1 where a pixel is above the threshold, and which component it is of
    window         index of the component's window
    x, y           px in the picture, the mean of its pixels; left, top, width, height px, the box that holds them
    pixels         their number
    """

    mask: NDArray[np.uint8]
    labels: NDArray[Any]
    window: Ints
    x: Array
    y: Array
    left: Ints
    top: Ints
    width: Ints
    height: Ints
    pixels: Ints


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


def cut(image: Picture, left: Ints, top: Ints, width: int, height: int) -> Picture:
    """Rectangles of one picture, (height, n, width), copied in one gather.

    left, top (n,) whole px with 0 <= left <= columns - width and so for top; the caller keeps to that.
    """
    rows, columns = image.shape
    strips = np.lib.stride_tricks.as_strided(
        image,
        shape=(rows, columns - width + 1, width),
        strides=(image.strides[0], image.strides[1], image.strides[1]),
        writeable=False,
    )
    cutting: Picture = strips[top + np.arange(height)[:, None], left]
    return cutting


def components(windows: Windows, threshold: ArrayLike) -> Components:
    """Connected patches (8 neighbours) of pixels above the threshold in every window.

    threshold  grey levels 0-255, one for all or (n,)
    """
    return components_of(above(windows, threshold), windows)


def above(windows: Windows, threshold: ArrayLike) -> Bools:
    """Which pixels are above the threshold, (height, n, width); grey levels 0-255, one for all or (n,)."""
    level = np.asarray(threshold, float) / windows.scale
    if windows.raw.dtype.kind == "u":  # integers compare fastest with their own kind
        level = np.clip(np.floor(level), 0, np.iinfo(windows.raw.dtype).max)
    level = level.astype(windows.raw.dtype)
    marked: Bools = windows.raw > (level[:, None] if level.ndim else level)
    return marked


def components_of(above: NDArray[Any], windows: Windows) -> Components:
    """Connected patches of pixels that are marked, (height, n, width), in every window."""
    height, n, width = above.shape
    step = width + SEPARATOR
    mask = np.zeros((height, n, step), np.uint8)
    mask[..., :width] = above
    kind = cv2.CV_16U if mask.size < 4 * 65_000 else cv2.CV_32S  # a component takes four pixels at least
    _, labels, stats, middle = cv2.connectedComponentsWithStats(
        mask.reshape(height, n * step), connectivity=8, ltype=kind
    )
    left, top, wide, high, count = stats[1:].T.astype(np.intp)
    middle = middle[1:]
    window = left // step
    shift = windows.left[window] - window * step
    rows = windows.top[window]
    return Components(
        mask,
        labels.reshape(mask.shape),
        window,
        middle[:, 0] + shift,
        middle[:, 1] + rows,
        left + shift,
        top + rows,
        wide,
        high,
        count,
    )


def measure(
    windows: Windows,
    found: Components,
    chosen: Ints,
    *,
    noise: float,
    kind: Kind = "weighted",
    threshold: ArrayLike | None = None,
) -> Centroids:
    """The centroid of one component in each window.

    windows, found  from `components`
    chosen          (n,) index of the target's component (a row of `found`), -1 for none: its row is NaN
    noise           grey levels, standard deviation of a pixel; sets how far down the soft edge is followed
    kind            weighted: sum(w x) / sum(w), w the intensity above the background over the target and its soft edge;
                    binary: mean x of the pixels above the threshold (4.2.1, 4.2.2);
                    ellipse: a soft-edged elliptical disc is fitted, for targets that are tiny or saturated
    threshold       grey levels, as given to `components`; not known: taken to be half-way up the target
    """
    height, n, width = windows.raw.shape
    grey = np.zeros((height, n, width + SEPARATOR), np.float32)
    np.multiply(windows.raw, np.float32(windows.scale), out=grey[..., :width])
    none = chosen < 0
    alone = found.window.size == n and not none.any()
    target = found.mask if alone else _own_pixels(found, chosen)
    pixels = found.pixels[chosen] * ~none if found.pixels.size else np.zeros(n, np.intp)
    sums = _sums(height, width)
    plane = _background(grey, found.mask, sums, noise)
    plateau = _plateau(grey, target, plane, pixels)
    rise = 0.5 * plateau if threshold is None else np.asarray(threshold) - plane.value
    level = plane.value + np.maximum(4.5 * noise, 0.1 * rise)
    low = _low(windows, level, target.shape)
    region = soft_edge(low, target, None if alone else found.mask)
    x, y, mass, sd_x, sd_y, area = weighted(grey, region, plane, sums)
    contrast = mass / np.where(pixels > 0, pixels, np.nan)
    if kind == "binary":
        x, y, sd_x, sd_y = _binary(target, sums)
    elif kind == "ellipse":
        x, y, sd_x, sd_y = _ellipse(grey, region, plane, sums, contrast, pixels, x, y)
    if kind != "binary":
        from vidtrack.tracking.measurement.deblending import crowded, measure_beside

        who = crowded(low, target, None if alone else found.mask & ~target)
        if (who := who[pixels[who] > 0]).size:
            fitted = kind == "ellipse"
            who, beside = measure_beside(
                grey, target, found.mask, who, sums, rise=rise, pixels=pixels, noise=noise, always_fitted=fitted
            )
            plateau += plane.value
            for values, better in zip((x, y, mass, sd_x, sd_y, area, *plane), beside, strict=True):
                values[..., who] = better
            plateau -= plane.value
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
    )


def _own_pixels(found: Components, chosen: Ints) -> NDArray[np.uint8]:
    """1 on the chosen component of each window."""
    wanted = np.where(chosen >= 0, chosen + 1, -1).astype(found.labels.dtype)
    own: NDArray[np.uint8] = (found.labels == wanted[:, None]).view(np.uint8)
    return own


def _saturated(windows: Windows, target: NDArray[np.uint8], pixels: Ints) -> Bools:
    """Whether at least a twentieth of each target is at full scale."""
    if windows.raw.size == 0 or windows.raw.max() * windows.scale < FULL_SCALE:
        return np.zeros(pixels.size, bool)
    full = (windows.raw >= FULL_SCALE / windows.scale) & (target[..., : windows.raw.shape[2]] > 0)
    enough: Bools = full.sum(axis=(0, 2)) * 20 >= np.maximum(pixels, 1)
    return enough


class Sums:
    """Sums of x^l y^k over every window, x and y from the window's middle: two matrix products."""

    def __init__(self, height: int, width: int) -> None:
        self.middle_x, self.middle_y = (width - 1) / 2, (height - 1) / 2
        x = np.arange(width + SEPARATOR, dtype=np.float32) - np.float32(self.middle_x)
        y = np.arange(height, dtype=np.float32) - np.float32(self.middle_y)
        self.x = np.stack([np.ones_like(x), x, x * x], axis=1)
        self.y = np.stack([np.ones_like(y), y, y * y], axis=0)

    def moments(self, weight: NDArray[Any], rows: slice = slice(None)) -> Array:
        """(3, 3, n): [k, l] = sum of weight y^k x^l; weight (height, n, width), or only those rows of it."""
        height, n, width = weight.shape
        along = weight.astype(np.float32, copy=False).reshape(height * n, width) @ self.x
        sums = (self.y[:, rows] @ along.reshape(height, n * 3)).reshape(3, n, 3).transpose(0, 2, 1)
        return np.ascontiguousarray(sums, float)


_sums = lru_cache(maxsize=64)(Sums)


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


EVERY_OTHER = slice(0, None, 2)
"""Every other row tells the background well enough: it adds 0.002 px to a centroid's error of 0.009 px."""


def _background(grey: Picture, mask: NDArray[np.uint8], sums: Sums, noise: float) -> Plane:
    """A plane under each window, fitted to the pixels more than three away from anything above the threshold.

    Where what it leaves is much more than the noise (a dim rope, a shadow), the pixels that stand off are dropped and
    the plane is fitted again.
    """
    height, n, width = grey.shape
    near = cv2.dilate(mask.reshape(height, n * width), _SQUARE7).reshape(grey.shape)[EVERY_OTHER]
    outside = (near == 0).astype(np.float32)
    outside[..., width - SEPARATOR :] = 0
    part = grey[EVERY_OTHER]
    plane = plane_under(part, outside, sums)
    rough = plane.noise > 2 * max(noise, QUANTISATION_SD)
    return _refitted(part, outside, sums, plane, np.flatnonzero(rough)) if rough.any() else plane


def _refitted(part: Picture, outside: NDArray[np.float32], sums: Sums, plane: Plane, rough: Ints) -> Plane:
    """The planes with those of some windows fitted again, without the pixels that stand off."""
    some, free = part[:, rough], outside[:, rough]
    fit = Plane(*(values[..., rough] for values in plane))
    for _ in range(3):
        off = np.abs(some - on_grid(fit.slope, sums, EVERY_OTHER))
        fit = plane_under(some, free * (off < (2.0 * fit.noise.astype(np.float32))[:, None]), sums)
    tilt, unrest = plane.slope.copy(), plane.noise.copy()
    for values, better in zip(plane[:3], fit[:3], strict=True):
        values[..., rough] = better
    return plane._replace(tilt=plane.slope - tilt, unrest=unrest)


def on_grid(slope: Array, sums: Sums, rows: slice = slice(None)) -> NDArray[np.float32]:
    """The planes' grey levels at every pixel of (some rows of) their windows, (height, n, width)."""
    a, b, c = slope.astype(np.float32)[:, :, None]
    level: NDArray[np.float32] = (a + b * sums.x[:, 1]) + c * sums.y[1][rows, None, None]
    return level


def plane_under(grey: Picture, outside: NDArray[np.float32], sums: Sums) -> Plane:
    """Least squares of 1, x, y over the marked pixels; flat where there are too few to tell a slope."""
    lit = outside * grey
    s, r = sums.moments(outside, EVERY_OTHER), sums.moments(lit, EVERY_OTHER)
    squares = np.einsum("hnw,hnw->n", lit, grey)
    count = np.maximum(s[0, 0], 1e-6)
    mean, x, y = r[0, 0] / count, s[0, 1] / count, s[1, 0] / count
    # second moments about the middle of the marked pixels, with a gentle pull of the slope to zero
    xx, yy, xy = s[0, 2] - s[0, 1] * x + _PULL, s[2, 0] - s[1, 0] * y + _PULL, s[1, 1] - s[0, 1] * y
    by_x, by_y = r[0, 1] - r[0, 0] * x, r[1, 0] - r[0, 0] * y
    determinant = xx * yy - xy * xy
    b, c = (yy * by_x - xy * by_y) / determinant, (xx * by_y - xy * by_x) / determinant
    left_over = squares - r[0, 0] * mean - b * by_x - c * by_y
    noise = np.sqrt(np.maximum(left_over, 0) / np.maximum(count - 3, 1))
    slope = np.stack([mean - b * x - c * y, b, c])
    noise = np.maximum(noise, QUANTISATION_SD)
    return Plane(slope, np.stack([yy, xx]) / determinant, noise, noise, np.zeros_like(slope))


_PULL = 100.0
"""px^2: a slope of 0.1 grey levels/px is as unlikely as a pixel off by the noise."""


def _plateau(grey: Picture, target: NDArray[np.uint8], plane: Plane, pixels: Ints) -> Array:
    """Mean grey level of the pixels above the threshold over the background, (n,)."""
    total = np.einsum("hnw,hnw->n", grey, target.astype(np.float32))
    return np.asarray(total / np.maximum(pixels, 1) - plane.value, float)


def _low(windows: Windows, level: Array, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """1 where pixels are above `level` (n,), in an array of this shape."""
    low = np.zeros(shape, np.uint8)
    low[..., : windows.raw.shape[2]] = above(windows, level)
    return low


def soft_edge(low: NDArray[np.uint8], target: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> NDArray[np.uint8]:
    """The target with its soft edge: grown twice through pixels that are `low` or more, then by one more.

    mask  everything above the threshold: pixels within two of what is not the target are nobody's. None: nothing else
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
    region[..., -SEPARATOR:] = 0
    return np.asarray(region, np.uint8)


def weighted(
    grey: Picture, region: NDArray[np.uint8], plane: Plane, sums: Sums
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """x, y (from the window's middle), mass, sd_x, sd_y over the region, the plane taken off; and its area, px^2.

    The noise of each pixel moves x by (x_i - x) / mass; an error of the plane's slope by sum(x_i^2) / mass.
    """
    weight = region.astype(np.float32)
    g, w = sums.moments(weight), sums.moments(weight * grey)
    a, b, c = plane.slope
    mass = w[0, 0] - a * g[0, 0] - b * g[0, 1] - c * g[1, 0]
    mass = np.where(mass > 0, mass, np.nan)
    x = (w[0, 1] - a * g[0, 1] - b * g[0, 2] - c * g[1, 1]) / mass
    y = (w[1, 0] - a * g[1, 0] - b * g[1, 1] - c * g[2, 0]) / mass
    across = g[0, 2] - (2 * g[0, 1] - g[0, 0] * x) * x
    down = g[2, 0] - (2 * g[1, 0] - g[0, 0] * y) * y
    share = plane.noise / mass
    sd_x = share * np.sqrt(np.maximum(across, 0) + plane.variance[0] * across * across)
    sd_y = share * np.sqrt(np.maximum(down, 0) + plane.variance[1] * down * down)
    return x, y, mass, sd_x, sd_y, g[0, 0]


def _binary(target: NDArray[np.uint8], sums: Sums) -> tuple[Array, Array, Array, Array]:
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
    from vidtrack.tracking.measurement.disc_fit import fit_soft_discs

    wider = cv2.dilate(region.reshape(grey.shape[0], -1), _SQUARE3).reshape(grey.shape)
    wider[..., -SEPARATOR:] = 0
    fit = fit_soft_discs(
        grey - on_grid(plane.slope, sums),
        wider,
        grey >= FULL_SCALE,
        middle=(sums.middle_x, sums.middle_y),
        x=x,
        y=y,
        radius=np.sqrt(np.maximum(pixels, 1) / np.pi),
        contrast=contrast,
        noise=plane.noise,
    )
    return fit.x, fit.y, fit.sd_x, fit.sd_y
