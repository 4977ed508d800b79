"""A blob that two discs explain and no ellipse: two balls that touch or overlap, of which neither was seen alone.

The union of two alike discs of radius r, d apart, has the second moments lambda along and mu across their line of

    area = 4 int h,  lambda area = 4 int x^2 h,  mu area = 4/3 int h^3,   h(x) = sqrt(r^2 - (x - d/2)^2), x > 0

so that the blob's elongation (lambda - mu) / (lambda + mu) gives d / r, and its area r. From there both discs are
fitted together (`joint_fit`). An ellipse with the blob's own area and second moments is what a single thing seen
askew, or drawn out by motion, would show, and one disc fitted alike is what a ball shows whose picture has pixels that
are not square: where the two discs leave far less than either, and little at all, they are two. Half a disc, a streak
and a rectangle are described by none of these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.measurement.disc_fit import Float32
from vidtrack.tracking.measurement.fit_apart import Piece, without_background
from vidtrack.tracking.measurement.joint_fit import JOINT_FIT, Joint, Shapes, fit_together


@dataclass(frozen=True)
class TwoDiscs:
    """When a blob is two discs.

    elongated   of (lambda - mu) / (lambda + mu), from which a blob is looked at: discs of 5 px radius whose middles are
                0.45 radii apart have it
    fewest      pixels of a blob: below, the grid hides how the two models differ
    prior       sd of log half axes, of the light (share) and of log blur of discs that were never seen alone
    left        rms that the two discs leave, at most: of the noise, and misfit of their light where that is more
    of_one      of what the ellipse leaves, or one disc, which the two leave at most
    apart       of their radius, that the middles are apart at least
    round       |log| of the ratio of a disc's axes, at most; alike: of the radii of both
    light       |log| of the ratio of their lights, at most
    """

    elongated: float = 0.12
    fewest: int = 40
    prior: tuple[float, float, float] = (0.3, 0.3, 0.6)
    left: float = 1.5
    misfit: float = 0.04
    of_one: float = 0.5
    apart: float = 0.4
    round: float = 0.2
    alike: float = 0.7
    light: float = 0.7


TWO_DISCS = TwoDiscs()


class Pair(NamedTuple):
    """Two discs (2,): px as the window counts them; shape (SHAPE, 2), as `Joint` has it; background (2,) grey levels
    under each; measured: the fit says where each is, and not only that they are two.
    """

    x: Array
    y: Array
    shape: Array
    background: Array
    measured: bool


def elongation(xx: Array, yy: Array, xy: Array) -> Array:
    """(lambda - mu) / (lambda + mu) of second moments; 0 for a disc, 1 for a line."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.hypot(xx - yy, 2 * xy) / (xx + yy))


def two_discs(
    grey: Float32, hidden: NDArray[np.bool_], x: float, y: float, contrast: float, noise: float, lines: int = 1
) -> Pair | None:
    """The two discs that a blob at x, y (px of the window) is; None where it is not plainly two.

    grey    (height, width) grey levels; hidden: what something else may light; noise: grey levels, of a pixel
    contrast  grey levels, of the blob over its background; lines: of the frame buffer to a row of the window
    """
    blob = blob_at(grey, hidden, x, y, contrast)
    if blob is None or np.count_nonzero(blob) * lines < TWO_DISCS.fewest:
        return None
    row, column = np.nonzero(blob)
    u, v = column - column.mean(), (row - row.mean()) * lines
    xx, yy, xy = float((u * u).mean()), float((v * v).mean()), float((u * v).mean())
    long = float(elongation(np.array(xx), np.array(yy), np.array(xy)))
    if long < TWO_DISCS.elongated:
        return None
    border = np.sqrt(4 * np.array([xx, yy])) / (1, lines)
    at_x, at_y = column.mean(keepdims=True), row.mean(keepdims=True)
    piece = without_background(grey, hidden, at_x, at_y, border[:, None] + 1, noise)
    light, own_noise = float(np.median(piece.over[blob])), max(noise, piece.noise)
    if light <= 0:
        return None
    little = max(TWO_DISCS.left * own_noise, TWO_DISCS.misfit * light)
    one = discs_fitted(piece, hidden, at_x, at_y, np.log(border)[:, None], light, own_noise)
    if one.left < little:
        return None
    apart, area = _union(long)
    radius = float(np.sqrt(row.size * lines / area))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    step = 0.5 * apart * radius * np.array([np.cos(angle), np.sin(angle) / lines])
    at_x, at_y = column.mean() + step[0] * np.array([-1, 1]), row.mean() + step[1] * np.array([-1, 1])
    axes = np.log(np.array([[radius], [radius / lines]])) * np.ones(2)
    piece = without_background(grey, hidden, at_x, at_y, np.exp(axes) + 1, noise)
    over, light, own_noise = piece.over, float(np.median(piece.over[blob])), max(noise, piece.noise)
    if light <= 0:
        return None
    fit = discs_fitted(piece, hidden, at_x, at_y, axes, light, own_noise)
    if not np.isfinite(fit.shape).all() or not fit.left < max(
        TWO_DISCS.left * own_noise, TWO_DISCS.misfit * float(np.exp(fit.shape[2]).min())
    ):
        return None
    between = np.hypot(*np.diff(fit.x), *(np.diff(fit.y) * lines))
    if between < TWO_DISCS.apart * float(np.exp(fit.shape[0].mean())):
        return None
    squashed = np.abs(fit.shape[0] - fit.shape[1] - np.log(lines))
    sizes, lights = (abs(float(np.diff(values)[0])) for values in (fit.shape[:2].mean(axis=0), fit.shape[2]))
    if squashed.max() > TWO_DISCS.round or sizes > TWO_DISCS.alike or lights > TWO_DISCS.light:
        return None
    second = np.array([[xx, xy / lines], [xy / lines, yy / lines**2]])
    near = _within(grey.shape, fit.x, fit.y, np.exp(fit.shape[:2]) + JOINT_FIT.reach_px) & ~hidden & ~piece.clipped
    ellipse = _ellipse(grey.shape, float(column.mean()), float(row.mean()), second, float(np.exp(fit.shape[3]).mean()))
    scale = float((over[near] * ellipse[near]).sum() / max(float((ellipse[near] ** 2).sum()), 1e-9))
    of_ellipse = float(np.sqrt(np.square(over[near] - scale * ellipse[near]).mean()))
    if not fit.left < TWO_DISCS.of_one * min(of_ellipse, one.left):
        return None
    return Pair(fit.x, fit.y, fit.shape, piece.background, fit.good)


def discs_fitted(
    piece: Piece, hidden: NDArray[np.bool_], x: Array, y: Array, axes: Array, light: float, noise: float
) -> Joint:
    """As many discs as there are places x, y (m,), with the logarithms of half axes (2, m), fitted together."""
    n = x.size
    value = np.concatenate([axes, np.full((1, n), np.log(light)), np.full((1, n), -0.4)])
    log_axis, log_light, log_blur = TWO_DISCS.prior
    known = Shapes(value, np.repeat([[log_axis], [log_axis], [log_light], [log_blur]], n, axis=1))
    return fit_together(piece.over, ~hidden, piece.clipped, x, y, known, noise)


def blob_at(grey: Float32, hidden: NDArray[np.bool_], x: float, y: float, contrast: float) -> Bools | None:
    """The pixels (height, width) of the blob at x, y that are more than half-way up; None where there is none, or where
    it reaches the window's edge.
    """
    height, width = grey.shape
    border = np.concatenate([grey[[0, -1]].ravel(), grey[:, [0, -1]].ravel()])
    mask = ((grey > float(np.median(border)) + contrast / 2) & ~hidden).astype(np.uint8)
    _, labels = cv2.connectedComponents(mask, connectivity=8)
    column, row = int(np.clip(round(x), 0, width - 1)), int(np.clip(round(y), 0, height - 1))
    label = int(labels[row, column])
    if not label:  # the middle of two that only just touch may be dark
        label = int(labels[max(0, row - 2) : row + 3, max(0, column - 2) : column + 3].max(initial=0))
    if not label:
        return None
    blob = labels == label
    if blob[[0, -1]].any() or blob[:, [0, -1]].any():
        return None
    return np.asarray(blob)


@lru_cache(maxsize=1)
def _unions() -> tuple[Array, Array, Array]:
    """Elongations and areas of two discs of radius 1, so far apart."""
    apart = np.linspace(0.0, 2.0, 81)
    t = (np.arange(400) + 0.5) / 400
    x = t * (1 + apart[:, None] / 2)
    h = np.sqrt(np.maximum(1 - np.square(x - apart[:, None] / 2), 0.0))
    step = (1 + apart / 2) / 400
    area, along, across = (4 * (of * h).sum(axis=1) * step for of in (np.ones_like(x), x * x, h * h / 3))
    return (along - across) / (along + across), area, apart


def _union(long: float) -> tuple[float, float]:
    """How far apart two discs of radius 1 are whose union has this elongation, and its area."""
    elongations, area, apart = _unions()
    d = float(np.interp(long, elongations, apart))
    return d, float(np.interp(d, apart, area))


def _within(shape: tuple[int, ...], x: Array, y: Array, half: Array) -> Bools:
    row, column = np.ogrid[: shape[0], : shape[1]]
    out = np.zeros(shape, bool)
    for i in range(x.size):
        out |= (np.abs(column - x[i]) < half[0, i]) & (np.abs(row - y[i]) < half[1, i])
    return out


def _ellipse(shape: tuple[int, ...], x: float, y: float, second: Array, blur: float) -> Float32:
    """Share of each pixel that an ellipse with these second moments covers, its edge blurred by so many px."""
    from scipy.special import ndtr

    row, column = np.mgrid[: shape[0], : shape[1]]
    off = np.stack([column - x, row - y], axis=-1)
    rho = np.sqrt(np.einsum("...i,ij,...j->...", off, np.linalg.inv(second), off) / 4) + 1e-6
    radius = 2 * float(np.linalg.det(second)) ** 0.25
    return np.asarray(ndtr((1 - rho) * radius / np.hypot(blur, 0.29)), np.float32)
