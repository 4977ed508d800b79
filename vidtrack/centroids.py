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

from typing import Any, Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.intp]
Picture = NDArray[Any]
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

    labels         (height, n, width + SEPARATOR), 0 outside of every component
    window         index of the component's window
    x, y           px in the picture, the mean of its pixels; left, top, width, height px, the box that holds them
    pixels         their number
    """

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
    noise          grey levels, what the background plane leaves
    saturated      at least a twentieth of the target is at full scale
    """

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    pixels: Ints
    mass: Array
    contrast: Array
    background: Array
    noise: Array
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
    level = np.asarray(threshold, float) / windows.scale
    if windows.raw.dtype.kind == "u":  # integers compare fastest with their own kind
        level = np.clip(np.floor(level), 0, np.iinfo(windows.raw.dtype).max)
    level = level.astype(windows.raw.dtype)
    return components_of(windows.raw > (level[:, None] if level.ndim else level), windows)


def components_of(above: NDArray[Any], windows: Windows) -> Components:
    """Connected patches of pixels that are marked, (height, n, width), in every window."""
    height, n, width = above.shape
    step = width + SEPARATOR
    mask = np.zeros((height, n, step), np.uint8)
    mask[..., :width] = above
    _, labels, stats, middle = cv2.connectedComponentsWithStats(
        mask.reshape(height, n * step), connectivity=8, ltype=cv2.CV_32S
    )
    stats, middle = stats[1:].astype(np.intp), middle[1:]
    window = stats[:, cv2.CC_STAT_LEFT] // step
    shift = windows.left[window] - window * step
    rows = windows.top[window]
    return Components(
        labels.reshape(mask.shape),
        window,
        middle[:, 0] + shift,
        middle[:, 1] + rows,
        stats[:, cv2.CC_STAT_LEFT] + shift,
        stats[:, cv2.CC_STAT_TOP] + rows,
        stats[:, cv2.CC_STAT_WIDTH],
        stats[:, cv2.CC_STAT_HEIGHT],
        stats[:, cv2.CC_STAT_AREA],
    )


def measure(windows: Windows, found: Components, chosen: Ints, *, noise: float, kind: Kind = "weighted") -> Centroids:
    """The centroid of one component in each window.

    windows, found  from `components`
    chosen          (n,) index of the target's component (a row of `found`), -1 for none: its row is NaN
    noise           grey levels, standard deviation of a pixel; sets how far down the soft edge is followed
    kind            weighted: sum(w x) / sum(w), w the intensity above the background over the target and its soft edge;
                    binary: mean x of the pixels above the threshold (4.2.1, 4.2.2);
                    ellipse: a soft-edged elliptical disc is fitted, for targets that are tiny or saturated
    """
    height, n, width = windows.raw.shape
    grey = np.zeros((height, n, width + SEPARATOR), np.float32)
    np.multiply(windows.raw, np.float32(windows.scale), out=grey[..., :width])
    target = (found.labels == (chosen + 1)[None, :, None]) & (chosen >= 0)[None, :, None]
    sums = _Sums(height, width)
    plane = _background(grey, found.labels, sums, noise)
    own = sums.moments(target)
    pixels = np.rint(own[0, :, 0]).astype(np.intp)
    level = plane.value + np.maximum(4.5 * noise, 0.1 * _contrast(grey, target, plane, own))
    region = _soft_edge(grey, target, found.labels, level, width)
    x, y, mass, sd_x, sd_y = _weighted(grey, region, plane, sums)
    contrast = mass / np.where(pixels > 0, pixels, np.nan)
    if kind == "binary":
        x, y, sd_x, sd_y = _binary(target, own, sums)
    elif kind == "ellipse":
        x, y, sd_x, sd_y = _ellipse(grey, region, plane, sums, contrast, own, x, y)
    none = chosen < 0
    for values in (x, y, sd_x, sd_y, mass):
        values[none] = np.nan
    bright = grey >= FULL_SCALE
    saturated = (bright & target).sum(axis=(0, 2)) * 20 >= np.maximum(pixels, 1) if bright.any() else none & False
    return Centroids(
        x + windows.left + sums.middle_x,
        y + windows.top + sums.middle_y,
        sd_x,
        sd_y,
        pixels,
        mass,
        contrast,
        plane.value,
        plane.noise,
        saturated,
    )


class _Sums:
    """Sums of x^l y^k over every window, x and y from the window's middle: two matrix products."""

    def __init__(self, height: int, width: int) -> None:
        self.middle_x, self.middle_y = (width - 1) / 2, (height - 1) / 2
        x = np.arange(width + SEPARATOR, dtype=np.float32) - np.float32(self.middle_x)
        y = np.arange(height, dtype=np.float32) - np.float32(self.middle_y)
        self.x = np.stack([np.ones_like(x), x, x * x], axis=1)
        self.y = np.stack([np.ones_like(y), y, y * y], axis=0)

    def moments(self, weight: NDArray[Any]) -> Array:
        """(3, n, 3): [k, :, l] = sum of weight y^k x^l."""
        height, n, width = weight.shape
        along = weight.astype(np.float32, copy=False).reshape(height * n, width) @ self.x
        sums: Array = (self.y @ along.reshape(height, n * 3)).reshape(3, n, 3).astype(float)
        return sums


class _Plane(NamedTuple):
    value: Array
    """(n,) grey level at the middle of the window"""
    slope: Array
    """(n, 3) coefficients of 1, x, y"""
    covariance: Array
    """(n, 3, 3) of the coefficients, for noise of one grey level"""
    noise: Array
    """(n,) grey levels, residual standard deviation"""


def _background(grey: Picture, labels: NDArray[Any], sums: _Sums, noise: float) -> _Plane:
    """A plane under each window, fitted to the pixels more than three away from anything above the threshold.

    Where what it leaves is much more than the noise (a dim rope, a shadow), the pixels that stand off are dropped
    and the plane is fitted again.
    """
    height, _, width = grey.shape
    bright = (labels > 0).view(np.uint8).reshape(height, -1)
    outside = (cv2.dilate(bright, _SQUARE7) == 0).reshape(grey.shape)
    outside[..., width - SEPARATOR :] = False
    plane = _plane(grey, outside, sums)
    rough = np.flatnonzero(plane.noise > 1.5 * max(noise, QUANTISATION_SD))
    if rough.size == 0:
        return plane
    part, free = grey[:, rough], outside[:, rough]
    fit = _Plane(*(values[rough] for values in plane))
    for _ in range(3):
        level = _on_grid(fit.slope, sums)
        near = free & (np.abs(part - level) < (2.0 * fit.noise.astype(np.float32))[None, :, None])
        fit = _plane(part, near, sums)
    for values, better in zip(plane, fit, strict=True):
        values[rough] = better
    return plane


def _on_grid(slope: Array, sums: _Sums) -> NDArray[np.float32]:
    """The planes' grey levels at every pixel of their windows, (height, n, width)."""
    a = slope.astype(np.float32)
    level: NDArray[np.float32] = (
        a[None, :, 0, None]
        + a[None, :, 1, None] * sums.x[None, None, :, 1]
        + a[None, :, 2, None] * sums.y[1][:, None, None]
    )
    return level


def _plane(grey: Picture, outside: Bools, sums: _Sums) -> _Plane:
    """Least squares of 1, x, y over the marked pixels; flat where there are too few to tell a slope."""
    weight = outside.astype(np.float32)
    s = sums.moments(weight)
    lit = weight * grey
    r = sums.moments(lit)
    squares = (lit * grey).sum(axis=(0, 2), dtype=float)
    matrix = np.stack(
        [s[0, :, 0], s[0, :, 1], s[1, :, 0], s[0, :, 1], s[0, :, 2], s[1, :, 1], s[1, :, 0], s[1, :, 1], s[2, :, 0]], -1
    )
    matrix = matrix.reshape(-1, 3, 3)
    side = np.stack([r[0, :, 0], r[0, :, 1], r[1, :, 0]], -1)
    # A gentle pull of the slope to zero: 0.1 grey levels/px for a noise of 1.
    matrix[:, (1, 2), (1, 2)] += 100.0
    matrix[:, 0, 0] += 1e-6
    inverse = np.asarray(np.linalg.inv(matrix), float)
    slope = np.einsum("nij,nj->ni", inverse, side)
    left_over = np.maximum(squares - (slope * side).sum(-1), 0) / np.maximum(s[0, :, 0] - 3, 1)
    residual_sd = np.asarray(np.maximum(np.sqrt(left_over), QUANTISATION_SD), float)
    return _Plane(slope[:, 0].copy(), slope, inverse, residual_sd)


def _contrast(grey: Picture, target: Bools, plane: _Plane, own: Array) -> Array:
    """Mean grey level of the pixels above the threshold over the background, (n,)."""
    total = np.einsum("hnw,hnw->n", grey, target.astype(np.float32))
    contrast: Array = total / np.maximum(own[0, :, 0], 1) - plane.value
    return contrast


def _soft_edge(grey: Picture, target: Bools, labels: NDArray[Any], level: Array, width: int) -> Bools:
    """The target with its soft edge: grown twice through pixels above `level` (n,), then by one more.

    Pixels within two of another component are nobody's.
    """
    flat = (target.shape[0], -1)
    low = grey > level.astype(np.float32)[None, :, None]
    region = target.view(np.uint8)
    for _ in range(2):
        region = cv2.dilate(region.reshape(flat), _SQUARE3).reshape(target.shape)
        region &= low.view(np.uint8)
    region = cv2.dilate(region.reshape(flat), _SQUARE3).reshape(target.shape)
    others = (labels > 0) & ~target
    if others.any():
        near = cv2.dilate(others.view(np.uint8).reshape(flat), _SQUARE3, iterations=2).reshape(target.shape)
        region &= 1 - (near & ~target)
    region[..., width:] = 0
    whole: Bools = region.view(np.bool_)
    return whole


def _weighted(grey: Picture, region: Bools, plane: _Plane, sums: _Sums) -> tuple[Array, Array, Array, Array, Array]:
    """x, y (from the window's middle), mass, sd_x, sd_y over the region, the plane taken off.

    The noise of each pixel moves x by (x_i - x) / mass; the plane's own error adds to it.
    """
    g = sums.moments(region)
    w = sums.moments(grey * region)
    under = np.stack([g[:2, :, 0], g[:2, :, 1], g[1:, :, 0]])  # sums of 1, x, y times 1 and times y: (3, 2, n)
    a = plane.slope.T
    across = np.stack([g[0, :, 1], g[0, :, 2], g[1, :, 1]])
    mass = w[0, :, 0] - (a * under[:, 0]).sum(0)
    mass = np.where(mass > 0, mass, np.nan)
    x = (w[0, :, 1] - (a * across).sum(0)) / mass
    y = (w[1, :, 0] - (a * under[:, 1]).sum(0)) / mass
    sd = []
    for at, first, second in ((x, across, g[0, :, 2]), (y, under[:, 1], g[2, :, 0])):
        lever = (first - at * under[:, 0]).T
        spread = second - 2 * at * first[0] + at * at * g[0, :, 0]
        spread = spread + np.einsum("ni,nij,nj->n", lever, plane.covariance, lever)
        sd.append(plane.noise * np.sqrt(np.maximum(spread, 0)) / mass)
    return x, y, mass, sd[0], sd[1]


def _binary(target: Bools, own: Array, sums: _Sums) -> tuple[Array, Array, Array, Array]:
    """Mean x and y of the target's pixels (4.2.1, 4.2.2), and what counting whole pixels costs.

    A pixel on the rim is counted whole or not at all: an error of 1/12 px^2 in its area. The circle crosses 8 r
    pixels, sqrt(2) as many as the rim that erosion by a cross takes off, hence 1/8.
    """
    count = np.where(own[0, :, 0] > 0, own[0, :, 0], np.nan)
    x, y = own[0, :, 1] / count, own[1, :, 0] / count
    inner = cv2.erode(
        target.view(np.uint8).reshape(target.shape[0], -1), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    )
    rim = sums.moments(target.view(np.uint8) - inner.reshape(target.shape))
    spread_x = rim[0, :, 2] - 2 * x * rim[0, :, 1] + x * x * rim[0, :, 0]
    spread_y = rim[2, :, 0] - 2 * y * rim[1, :, 0] + y * y * rim[0, :, 0]
    return x, y, np.sqrt(spread_x / 8) / count, np.sqrt(spread_y / 8) / count


def _ellipse(
    grey: Picture, region: Bools, plane: _Plane, sums: _Sums, contrast: Array, own: Array, x: Array, y: Array
) -> tuple[Array, Array, Array, Array]:
    """x, y, sd_x, sd_y of a soft-edged elliptical disc; pixels at full scale only bound it from below."""
    from vidtrack.soft_disc import fit_soft_discs

    wider = cv2.dilate(region.view(np.uint8).reshape(grey.shape[0], -1), _SQUARE3).reshape(grey.shape)
    wider[..., -SEPARATOR:] = 0
    fit = fit_soft_discs(
        grey - _on_grid(plane.slope, sums),
        wider,
        grey >= FULL_SCALE,
        middle=(sums.middle_x, sums.middle_y),
        x=x,
        y=y,
        radius=np.sqrt(np.maximum(own[0, :, 0], 1) / np.pi),
        contrast=contrast,
        noise=plane.noise,
    )
    return fit.x, fit.y, fit.sd_x, fit.sd_y
