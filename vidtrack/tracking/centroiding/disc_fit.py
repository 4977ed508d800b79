"""A soft-edged elliptical disc fitted to each window: for targets that are tiny or saturated.

    I = A (mean of Phi(d / w) over a pixel),  d = (1 - rho) r  px inside of the edge,
    rho^2 = ((X - x)/rx)^2 + ((Y - y)/ry)^2,  r = sqrt(rx ry)

Phi is the normal distribution function: an edge that a Gaussian blur of w px has widened. The mean is exact along the
edge's normal, d - 1/2 to d + 1/2; where the edge is sharp a pixel is cut into four, as its width at right angles to
an oblique edge is not one px. A small r with a wide w is close to a Gaussian, so tiny targets need no other model. The
axes stay level: a tilted ellipse is symmetric about the same middle. Damped Gauss-Newton (Levenberg, Marquardt), all
windows at once.

The sd holds the noise (or what the fit leaves, where that is more), what pixels make of a sharp edge, and what a
linearised covariance leaves out where the sd is no small part of the disc.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array

Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class DiscFit:
    """How a disc is fitted.

    steps, fine_steps  with whole pixels, then with pixels cut into four where the edge is sharp
    begin_px           w to begin with
    least_px           w at least: no lens is sharper, and without a slope no edge can be located
    sharp_px           w below which pixels are cut
    grid_px            error in x and y that the pixels' grid makes of a perfectly sharp edge at radius 1, falling as
                       1 / sqrt(radius); measured on drawn discs of radius 1 to 20 px
    grid_blur_px       w beyond the least at which that error has fallen to 1 / e
    curved             of (sd / size)^2: by how much the variance exceeds the linearised one; measured on dim discs
    known              of the disc's size: a fit that leaves a larger sd has found nothing
    longest_step       of x, y (px), log half axes, contrast (grey levels) and log width, at once
    """

    steps: int = 10
    fine_steps: int = 5
    begin_px: float = 0.25
    least_px: float = 0.12
    sharp_px: float = 0.45
    grid_px: float = 0.0025
    grid_blur_px: float = 0.12
    curved: float = 30.0
    known: float = 0.5
    longest_step: tuple[float, ...] = (1.0, 1.0, 0.5, 0.5, 100.0, 0.5)


DISC_FIT = DiscFit()
_PHI_0 = float((2 * np.pi) ** -0.5)
_LONGEST_STEP = np.array(DISC_FIT.longest_step)
_DIAGONAL = np.arange(6)
_EYE = np.eye(6)


class SoftDiscs(NamedTuple):
    """px from the middle of the window, (n,); NaN where the fit ends far from its start, or is undetermined.

    mass  grey levels, the whole light of the disc
    """

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    mass: Array


def fit_soft_discs(
    data: NDArray[Any],
    weight: NDArray[Any],
    clipped: NDArray[Any],
    *,
    middle: tuple[float, float],
    x: Array,
    y: Array,
    radius: Array,
    contrast: Array,
    noise: Array,
) -> SoftDiscs:
    """Fit one disc in each window.

    data      (height, n, width) grey levels above the background
    weight    the same shape: 1 for pixels to fit, 0 for the rest; clipped: true for pixels at full scale, which only
              show that the disc is not below: they weigh nothing where it is above
    middle    column and row that x and y count from, px
    x, y, radius (px), contrast, noise (grey levels)  (n,) where the fit begins; NaN gives NaN
    """
    begin = np.stack([x, y, np.log(radius), np.log(radius), contrast, np.full_like(x, np.log(DISC_FIT.begin_px))])
    known = np.isfinite(begin).all(axis=0)
    begin = np.where(known, begin, 1.0)
    columns = np.arange(data.shape[2], dtype=float) - middle[0]
    rows = (np.arange(data.shape[0], dtype=float) - middle[1])[:, None, None]
    data, weight = data.astype(float), weight.astype(float)
    best, cost, normal = _descend(data, weight, clipped, rows, columns, begin, DISC_FIT.steps, fine=False)
    if (sharp := np.flatnonzero(best[5] < np.log(DISC_FIT.sharp_px))).size:
        some = data[:, sharp], weight[:, sharp], clipped[:, sharp]
        best[:, sharp], cost[sharp], normal[sharp] = _descend(
            *some, rows, columns, best[:, sharp], DISC_FIT.fine_steps, fine=True
        )
    scale = np.maximum(normal[:, _DIAGONAL, _DIAGONAL], 1e-6)
    variance = np.linalg.inv(normal + 1e-6 * scale[:, :, None] * _EYE)[:, _DIAGONAL, _DIAGONAL].T
    spare = np.maximum(weight.sum(axis=(0, 2), dtype=float) - 6, 1)
    width = np.exp(best[5])
    size2 = np.exp(best[2] + best[3]) + width**2
    linear = np.maximum(noise, np.sqrt(cost / spare)) ** 2 * np.maximum(variance[:2], 0)
    sd = np.sqrt(linear * (1 + DISC_FIT.curved * linear / size2) + grid_variance(size2, width))
    stayed = known & (np.hypot(best[0] - begin[0], best[1] - begin[1]) < 0.5 * radius + 1)
    area = np.pi * (size2 + 1 / 12)  # a blurred edge adds its variance to the squares of the radii, as the pixel does
    stayed &= (linear < (DISC_FIT.known * DISC_FIT.known) * size2).all(axis=0)
    found = (best[0], best[1], sd[0], sd[1], best[4] * area)
    return SoftDiscs(*(np.where(stayed, values, np.nan) for values in found))


def _descend(
    data: Array,
    weight: Array,
    clipped: NDArray[Any],
    rows: Array,
    columns: Array,
    begin: Array,
    steps: int,
    *,
    fine: bool,
) -> tuple[Array, Array, Array]:
    """Best unknowns (6, n), their sum of squares (n,) and normal matrix (n, 6, 6)."""
    n = begin.shape[1]
    trial, best = begin, begin
    cost, damping = np.full(n, np.inf), np.full(n, 1e-3)
    normal, gradient = np.zeros((n, 6, 6)), np.zeros((n, 6))
    for _ in range(steps):
        model, slopes = soft_disc(trial, rows, columns, fine=fine)
        free = weight * ~(clipped & (model >= data))
        left_over = (data - model) * free
        squares = (left_over * left_over).sum(axis=(0, 2), dtype=float)
        better = squares < cost
        best, cost = np.where(better, trial, best), np.where(better, squares, cost)
        damping = np.clip(np.where(better, damping / 5, damping * 10), 1e-9, 1e9)
        if better.any():
            flat = np.moveaxis(slopes * free, 2, 0).reshape(n, 6, -1)
            rest = np.moveaxis(left_over, 1, 0).reshape(n, -1, 1)
            normal = np.where(better[:, None, None], flat @ flat.transpose(0, 2, 1), normal)
            gradient = np.where(better[:, None], (flat @ rest)[..., 0], gradient)
        scale = np.maximum(normal[:, _DIAGONAL, _DIAGONAL], 1e-6)
        step = np.linalg.solve(normal + (damping[:, None] * scale)[:, :, None] * _EYE, gradient[:, :, None])[..., 0].T
        trial = best + np.clip(step, -_LONGEST_STEP[:, None], _LONGEST_STEP[:, None])
        trial[5] = np.maximum(trial[5], np.log(DISC_FIT.least_px))
    return best, cost, normal


def grid_variance(size2: Array, width: Array) -> Array:
    """px^2, what the pixels' grid adds to the variance of x and y of discs of this size^2 and blur (px)."""
    sharpness = np.exp(-(((width - DISC_FIT.least_px) / DISC_FIT.grid_blur_px) ** 2))
    return np.asarray((DISC_FIT.grid_px * sharpness) ** 2 / np.sqrt(size2))


def soft_disc(unknowns: Array, rows: Array, columns: Array, *, fine: bool) -> tuple[Array, Array]:
    """The disc (height, n, width) and its derivatives by x, y, log rx, log ry, A, log w: (6, height, n, width).

    In numbers of 64 bits: with 32 a fit ends up to 1e-5 px from where another processor's does.
    fine  pixels are cut into four
    """
    if not fine:
        return _sampled(unknowns, rows, columns, 0.5)
    parts = [
        _sampled(unknowns, rows + down * 0.25, columns + across * 0.25, 0.25) for down in (-1, 1) for across in (-1, 1)
    ]
    light, slopes = zip(*parts, strict=True)
    return np.asarray(sum(light) * 0.25), np.asarray(sum(slopes) * 0.25)


def _sampled(unknowns: Array, rows: Array, columns: Array, half: float) -> tuple[Array, Array]:
    """As `soft_disc`, the mean over d - half to d + half."""
    from scipy.special import ndtr  # few recordings need a fit, and its import takes as long as all others

    x, y, log_rx, log_ry, a, log_w = unknowns[:, None, :, None]
    rx, ry, w, h = np.exp(log_rx), np.exp(log_ry), np.exp(log_w), half
    dx, dy = (columns - x) / rx, (rows - y) / ry
    r, rho = np.sqrt(rx * ry), np.sqrt(dx * dx + dy * dy) + 1e-4
    d = (1 - rho) * r
    outer, inner = (d + h) / w, (d - h) / w
    p_outer, p_inner = ndtr(outer), ndtr(inner)
    f_outer, f_inner = _PHI_0 * np.exp(-outer * outer / 2), _PHI_0 * np.exp(-inner * inner / 2)
    span = w / (2 * h)
    s = span * (outer * p_outer - inner * p_inner + f_outer - f_inner)
    edge = a * (p_outer - p_inner) / (2 * h)
    push, half_edge = edge * r / rho, edge * d / 2
    by_width = a * span * (f_outer - f_inner)
    slopes = (push * dx / rx, push * dy / ry, push * dx * dx + half_edge, push * dy * dy + half_edge, s, by_width)
    return a * s, np.stack(slopes)
