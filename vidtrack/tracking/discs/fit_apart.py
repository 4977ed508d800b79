"""Discs of which it is known about where they are, measured in a piece of a picture by one fit of them all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.tracking.centroiding.background import background_plane, on_grid, sums_of
from vidtrack.tracking.centroiding.components import CUTTING
from vidtrack.tracking.discs.joint_fit import Joint, Shapes, fit_together

APART = 4.0
"""Least ratio of how far off discs are if they changed places, to how far they are, both squared."""
UNREST = 0.2
"""Of the light of the dimmest disc: rms that a fit may leave besides three times the recording's noise. What lights a
piece beside its discs, and is not hidden, makes the piece's own noise as large as itself."""


@dataclass(frozen=True)
class Piece:
    """A piece of a sample: grey levels over its background, those at full scale, the background under each target (m,),
    the noise about it, and the rms that the best fit of discs leaves of it, once there is one.
    """

    over: NDArray[np.float32]
    clipped: NDArray[np.bool_]
    background: Array
    noise: float
    left: float = np.nan


def fit_apart(
    grey: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    x: Array,
    y: Array,
    known: Shapes,
    noise: float,
    *,
    courses: bool = False,
    drawn: Array | None = None,
) -> tuple[Joint | None, Piece]:
    """Discs of known shapes, expected at x, y (m,) px of the piece; None where the fit does not hold.

    grey    (height, width) grey levels; hidden: what something else may light; noise: grey levels, of a pixel
    courses  whether a fit counts that shows no more than the courses of discs (`Joint.course`)
    drawn   (2, 2, m) px: how they move during the exposure, as of `fit_together`; None: they stand still
    """
    axes = np.exp(known.value[:2])
    axes = axes if drawn is None else axes + np.abs(drawn[0]) / 2
    piece = without_background(grey, hidden, x, y, axes, noise)
    fit = fit_together(piece.over, ~hidden, piece.clipped, x, y, known, max(noise, piece.noise), drawn=drawn)
    holds = (fit.good or (courses and fit.course)) and explained(fit, noise)
    return (fit if holds and each_its_own(fit, x, y) else None), replace(piece, left=fit.left)


def explained(fit: Joint, noise: float) -> bool:
    """Whether discs explain what a piece shows, with the recording's noise (grey levels) and little besides."""
    return fit.left < max(3 * noise, UNREST * float(np.exp(fit.shape[2]).min()))


def without_background(
    grey: NDArray[np.float32], hidden: NDArray[np.bool_], x: Array, y: Array, axes: Array, noise: float
) -> Piece:
    """A piece over the plane of what is beside the targets at x, y (m,) and not hidden."""
    height, width = grey.shape
    wide = np.zeros((height, 1, width + CUTTING.separator), np.float32)
    wide[:, 0, :width] = grey
    row, column = np.ogrid[:height, :width]
    mask = np.zeros(wide.shape, np.uint8)
    for i in range(x.size):
        own = ((column - x[i]) / (axes[0, i] + 1)) ** 2 + ((row - y[i]) / (axes[1, i] + 1)) ** 2 < 1
        mask[:, 0, :width] |= own.astype(np.uint8)
    mask[:, 0, :width] |= hidden
    sums = sums_of(height, width)
    plane = background_plane(wide, mask, sums, noise)
    under = on_grid(plane.slope, sums)[:, 0, :width]
    at = (np.clip(np.rint(y).astype(int), 0, height - 1), np.clip(np.rint(x).astype(int), 0, width - 1))
    return Piece(
        np.asarray(grey - under, np.float32), grey >= CUTTING.full_scale, under[at].astype(float), float(plane.noise[0])
    )


def each_its_own(fit: Joint, x: Array, y: Array) -> bool:
    """Whether each target is so much nearer to where it was expected than to where another was that all are certain."""
    own = np.square(fit.x - x) + np.square(fit.y - y)
    for i in range(x.size):
        for j in range(i):
            swapped = (fit.x[i] - x[j]) ** 2 + (fit.y[i] - y[j]) ** 2 + (fit.x[j] - x[i]) ** 2 + (fit.y[j] - y[i]) ** 2
            if swapped < APART * (own[i] + own[j]):
                return False
    return True
