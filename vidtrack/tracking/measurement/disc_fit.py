"""A soft-edged elliptical disc fitted to each window: for targets that are tiny or saturated.

    I = A (mean of 1 / (1 + exp(-d / w)) over a pixel),  d = (1 - rho) r  px inside of the edge,
    rho^2 = ((X - x)/rx)^2 + ((Y - y)/ry)^2,  r = sqrt(rx ry)

The mean over d - 1/2 to d + 1/2 is what a pixel of the sensor sees of an edge that blur has widened by w. A small
r with a wide w is close to a Gaussian, so tiny targets need no other model. The axes stay level: a tilted ellipse is
symmetric about the same middle. Damped Gauss-Newton (Levenberg, Marquardt), all windows at once.
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

    steps           of the iteration, at most
    start_width_px  of the edge, to begin with
    longest_step    of x, y (px), log half axes, contrast (grey levels) and log width, at once
    """

    steps: int = 12
    start_width_px: float = 0.25
    longest_step: tuple[float, ...] = (1.0, 1.0, 0.5, 0.5, 100.0, 0.5)


DISC_FIT = DiscFit()
_LONGEST_STEP = np.array(DISC_FIT.longest_step)

_DIAGONAL = np.arange(6)
_EYE = np.eye(6)


class SoftDiscs(NamedTuple):
    """px from the middle of the window, (n,); NaN where the fit ran away from where it began.

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
              tell that the disc is not below: they weigh nothing where it is above
    middle    column and row that x and y count from, px
    x, y, radius (px), contrast, noise (grey levels)  (n,) where the fit begins; NaN gives NaN
    """
    begin = np.stack([x, y, np.log(radius), np.log(radius), contrast, np.full_like(x, np.log(DISC_FIT.start_width_px))])
    known = np.isfinite(begin).all(axis=0)
    begin = np.where(known, begin, 1.0)
    columns = np.arange(data.shape[2], dtype=np.float32) - np.float32(middle[0])
    rows = (np.arange(data.shape[0], dtype=np.float32) - np.float32(middle[1]))[:, None, None]
    best, cost, normal = _descend(data.astype(np.float32), weight.astype(np.float32), clipped, rows, columns, begin)
    scale = np.maximum(normal[:, _DIAGONAL, _DIAGONAL], 1e-6)
    variance = np.linalg.inv(normal + 1e-6 * scale[:, :, None] * _EYE)[:, _DIAGONAL, _DIAGONAL].T
    spare = np.maximum(weight.sum(axis=(0, 2), dtype=float) - 6, 1)
    sd = np.maximum(noise, np.sqrt(cost / spare)) * np.sqrt(np.maximum(variance, 0))
    stayed = known & (np.hypot(best[0] - begin[0], best[1] - begin[1]) < 0.5 * radius + 1)
    # a blurred edge adds its variance to the squares of the radii: pi^2 w^2 / 3 of the logistic, 1/12 of the pixel
    area = np.pi * (np.exp(best[2] + best[3]) + (np.pi * np.exp(best[5])) ** 2 / 3 + 1 / 12)
    found = (best[0], best[1], sd[0], sd[1], best[4] * area)
    return SoftDiscs(*(np.where(stayed, values, np.nan) for values in found))


def _descend(
    data: Float32, weight: Float32, clipped: NDArray[Any], rows: Float32, columns: Float32, begin: Array
) -> tuple[Array, Array, Array]:
    """Best unknowns (6, n), their sum of squares (n,) and normal matrix (n, 6, 6)."""
    n = begin.shape[1]
    trial, best = begin, begin
    cost, damping = np.full(n, np.inf), np.full(n, 1e-3)
    normal, gradient = np.zeros((n, 6, 6)), np.zeros((n, 6))
    for _ in range(DISC_FIT.steps):
        model, slopes = _soft_disc(trial, rows, columns)
        free = weight * ~(clipped & (model >= data))
        left_over = (data - model) * free
        squares = np.einsum("hnw,hnw->n", left_over, left_over).astype(float)
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
    return best, cost, normal


def _soft_disc(unknowns: Array, rows: Float32, columns: Float32) -> tuple[Float32, Float32]:
    """The disc (height, n, width) and its derivatives by x, y, log rx, log ry, A, log w: (6, height, n, width)."""
    x, y, log_rx, log_ry, a, log_w = unknowns.astype(np.float32)[:, None, :, None]
    rx, ry, w = np.exp(log_rx), np.exp(log_ry), np.exp(log_w)
    dx, dy = (columns - x) / rx, (rows - y) / ry
    r, rho = np.sqrt(rx * ry), np.sqrt(dx * dx + dy * dy) + np.float32(1e-4)
    d = (1 - rho) * r
    outer, inner = (d + 0.5) / w, (d - 0.5) / w
    s = w * (np.logaddexp(0, outer) - np.logaddexp(0, inner))
    s_outer, s_inner = (1 / (1 + np.exp(-np.clip(z, -60, 60))) for z in (outer, inner))
    edge = a * (s_outer - s_inner)
    push, half = edge * r / rho, edge * d / 2
    by_width = a * (s - w * (outer * s_outer - inner * s_inner))
    slopes = (push * dx / rx, push * dy / ry, push * dx * dx + half, push * dy * dy + half, s, by_width)
    return a * s, np.stack(slopes)
