"""A blob in its window that may be several discs, and whether one disc explains it, which is found out once."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.disc_fit import Float32
from vidtrack.tracking.discs.fit_apart import Piece, without_background
from vidtrack.tracking.discs.joint_fit import Joint, Shapes, fit_together

FEWEST = 40
"""Pixels of a blob: below, the grid hides how one disc and several differ."""
LEFT, MISFIT = 1.5, 0.04
"""rms that discs leave, at most, where they explain a blob: of the noise, and of their light where that is more."""
PRIOR = (0.3, 0.3, 0.6)
"""sd of log half axes, of the light (share) and of log blur of discs that were never seen alone."""


class Clump:
    """A blob at x, y (px of the window).

    grey    (height, width) grey levels; hidden: what something else may light; noise: grey levels, of a pixel
    contrast  grey levels, of the blob over its background; lines: of the frame buffer to a row of the window

    `pixels` (n, 2) column and row of those more than half-way up; `moments` xx, yy, xy of them, px^2 of the buffer.
    """

    def __init__(self, grey: Float32, hidden: Bools, blob: Bools, noise: float, lines: int) -> None:
        self.grey, self.hidden, self.blob, self.noise, self.lines = grey, hidden, blob, noise, lines
        row, column = np.nonzero(blob)
        self.pixels = np.stack([column, row], axis=1)
        self.middle = self.pixels.mean(axis=0)
        u, v = column - self.middle[0], (row - self.middle[1]) * lines
        self.moments = float((u * u).mean()), float((v * v).mean()), float((u * v).mean())

    @property
    def long(self) -> float:
        """(lambda - mu) / (lambda + mu) of its second moments."""
        return float(elongation(*(np.array(moment) for moment in self.moments)))

    @cached_property
    def one_leaves(self) -> float:
        """rms that one disc leaves of it, grey levels; 0 where it explains it."""
        border = np.sqrt(4 * np.array(self.moments[:2])) / (1, self.lines)
        x, y = self.middle[:1], self.middle[1:]
        piece = self.about(x, y, border[:, None])
        light, noise = self.light(piece), max(self.noise, piece.noise)
        if light <= 0:
            return 0.0
        little = allowed(noise, light)
        left = self.fitted(piece, x, y, np.log(border)[:, None], little).left
        return 0.0 if left < little else left

    @property
    def against_one(self) -> bool:
        """Whether one disc was fitted to it and does not explain it."""
        return "one_leaves" in vars(self) and self.one_leaves > 0

    def about(self, x: Array, y: Array, axes: Array) -> Piece:
        """The window over the background about places x, y (m,) of discs with half axes (2, m)."""
        return without_background(self.grey, self.hidden, x, y, axes + 1, self.noise)

    def light(self, piece: Piece) -> float:
        """Grey levels of the blob over the background."""
        return float(np.median(piece.over[self.blob]))

    def fitted(self, piece: Piece, x: Array, y: Array, axes: Array, enough: float = 0.0) -> Joint:
        """As many discs as there are places x, y (m,), with the logarithms of half axes (2, m), fitted together.

        enough  rms, grey levels: where less is left, the fit ends
        """
        n, light = x.size, self.light(piece)
        value = np.concatenate([axes, np.full((1, n), np.log(light)), np.full((1, n), -0.4)])
        log_axis, log_light, log_blur = PRIOR
        known = Shapes(value, np.repeat([[log_axis], [log_axis], [log_light], [log_blur]], n, axis=1))
        noise = max(self.noise, piece.noise)
        return fit_together(piece.over, ~self.hidden, piece.clipped, x, y, known, noise, enough)


def clump_at(
    grey: Float32, hidden: NDArray[np.bool_], x: float, y: float, contrast: float, noise: float, lines: int = 1
) -> Clump | None:
    """The blob at x, y of a window, as `Clump` has them; None where there is none, it is small or reaches the edge."""
    blob = _blob_at(grey, hidden, x, y, contrast)
    if blob is None or np.count_nonzero(blob) * lines < FEWEST:
        return None
    return Clump(grey, hidden, blob, noise, lines)


def elongation(xx: Array, yy: Array, xy: Array) -> Array:
    """(lambda - mu) / (lambda + mu) of second moments; 0 for a disc, 1 for a line."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.hypot(xx - yy, 2 * xy) / (xx + yy))


def allowed(noise: float, light: float) -> float:
    """rms, grey levels, that discs leave at most where they explain a blob."""
    return max(LEFT * noise, MISFIT * light)


def _blob_at(grey: Float32, hidden: NDArray[np.bool_], x: float, y: float, contrast: float) -> Bools | None:
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
