"""What the shape of a target's light says of its centroid: something before it, something beside it, motion blur.

Second moments of the light, over their sum, do not depend on how bright or how far away a target is. Where they differ
from what is usual of the target, by far more than they scatter, a part of it is hidden (a rope) or something is added
(glitter, a neighbour): what changes the second moments by D at the distance r from the middle moves the middle by D/r.

An exposure of T samples draws a moving target out: with the velocity v (px a sample) the second moments grow by
T^2 v v^T / 12. The middle of such a streak is the mean over the exposure, which differs from the position in the middle
of the exposure by T^2/24 times the acceleration; T shows in how the moments go with the velocity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.state import PIXELS, XX, XY, YY, X, Y


@dataclass(frozen=True)
class Shapes:
    """When a shape says something.

    fewest     samples of a target that say what is usual of it, and of blur that say how long the exposure was
    beyond     standard deviations from the usual shape that are no chance
    like_rest  a target's own scatter counts for so many times that of the others at most: it may be hidden often
    arm        of its radius, at which a change of the second moments is taken to be
    longest    exposure, samples
    sure       standard deviations of its square from which on an exposure is corrected
    unknown    share of that correction that is not known
    ends       of a streak's length, by which it may be seen further at one end, where it is slower (measured 0.01 to
               0.02 on drawn balls)
    """

    fewest: int = 16
    beyond: float = 5.0
    like_rest: float = 3.0
    arm: float = 0.6
    longest: float = 1.1
    sure: float = 6.0
    unknown: float = 0.3
    ends: float = 0.015


SHAPES = Shapes()


class ShapeEvidence(NamedTuple):
    """What shapes say.

    position  (2, k, n) px, in the middle of the exposure; sd (2, k, n) px, what shapes add to that of x and y
    exposure  samples; 0: too short to be seen
    """

    position: Array
    sd: Array
    exposure: float


def shape_evidence(values: Array, time: Array, lines: int = 1) -> ShapeEvidence:
    """What the shapes in values (MEASURED, k, n) say.

    time  (k,) samples; lines: of the frame buffer to a row of a sample
    """
    second, position = values[[XX, YY, XY]], values[[X, Y]]
    sd = np.zeros(position.shape)
    seen = np.isfinite(second).all(axis=0) & (values[PIXELS] > 0)
    if not seen.any():
        return ShapeEvidence(position, sd, 0.0)
    velocity, acceleration = _motion(position, time)
    streak = np.stack([velocity[0] ** 2, velocity[1] ** 2, velocity[0] * velocity[1]]) / 12
    square = _exposure(second, streak, seen)
    if square:
        late = square / 24 * acceleration
        usual = np.sqrt(np.nanmean(np.square(late), axis=1, keepdims=True))
        position = position - np.nan_to_num(late)
        unknown = np.where(np.isfinite(late), SHAPES.unknown * np.abs(late), usual)
        ends = SHAPES.ends * np.sqrt(square) * np.abs(velocity)
        sd = np.hypot(np.nan_to_num(unknown), np.nan_to_num(ends))
        second = second - square * np.nan_to_num(streak)
    shift = _shift(second, np.where(seen, values[PIXELS], np.nan) * lines)
    return ShapeEvidence(position, np.hypot(sd, np.nan_to_num(shift)), float(np.sqrt(square)))


def _motion(position: Array, time: Array) -> tuple[Array, Array]:
    """Velocity and acceleration (2, k, n), px a sample and its square; NaN where a neighbour is missing."""
    velocity, acceleration = np.full((2, *position.shape), np.nan)
    if len(time) > 2:
        before, after = np.diff(time)[:-1, None], np.diff(time)[1:, None]
        steps = np.diff(position, axis=1)
        first, second = steps[:, :-1] / before, steps[:, 1:] / after
        velocity[:, 1:-1] = (first * after + second * before) / (before + after)
        acceleration[:, 1:-1] = 2 * (second - first) / (before + after)
    return velocity, acceleration


def _exposure(second: Array, streak: Array, seen: Bools) -> float:
    """The square of the exposure, samples^2; 0 where it is too short to be seen."""
    which = seen & np.isfinite(streak).all(axis=0)
    if which.sum() < SHAPES.fewest:
        return 0.0
    # what is alike in both directions is the target's size, whatever the distance
    seen_as = np.concatenate([(second[0] - second[1])[which], 2 * second[2][which]])
    made = np.concatenate([(streak[0] - streak[1])[which], 2 * streak[2][which]])
    half = int(which.sum())
    mean = float(np.median(seen_as[:half]))
    weight, square, sd = np.ones(seen_as.size), 0.0, np.inf
    for _ in range(10):
        w = weight * (made != 0)
        a, b = w[:half].sum(), (w[:half] * made[:half]).sum()
        c, d = (w[:half] * seen_as[:half]).sum(), (w * made * made).sum()
        e = (w * made * seen_as).sum()
        determinant = a * d - b * b
        if not determinant > 0:
            return 0.0
        mean, square = (c * d - b * e) / determinant, (a * e - b * c) / determinant
        left = seen_as - square * made
        left[:half] -= mean
        usual = max(1.4826 * float(np.median(np.abs(left))), 1e-9)
        weight = 1 / np.maximum(np.abs(left) / (2 * usual), 1.0)
        sd = usual * np.sqrt(a / determinant)
    if not square > SHAPES.sure * sd or square > SHAPES.longest**2:
        return 0.0
    return float(square)


def _shift(second: Array, area: Array) -> Array:
    """px (k, n), by which a part that is hidden or added may have moved the middle; 0 where the shape is the usual."""
    size = second[0] + second[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        shape = np.stack([(second[0] - second[1]) / size, 2 * second[2] / size, 2 * np.pi * size / area])
        radius = np.sqrt(area / np.pi)
    off, usual = _from_usual(shape)
    odd = np.abs(off) > SHAPES.beyond * usual[:, None]
    change = np.where(odd, np.abs(off), 0.0)
    far = np.max(np.nan_to_num(change), axis=0)
    return np.asarray(far * np.nan_to_num(size / (SHAPES.arm * radius)))


def _from_usual(shape: Array) -> tuple[Array, Array]:
    """How far shapes (3, k, n) are from what is usual of each target, and how much that scatters (3, n)."""
    count = np.isfinite(shape[0]).sum(axis=0)
    known = count >= SHAPES.fewest
    if not known.any():
        return np.zeros(shape.shape), np.ones((3, shape.shape[2]))
    usual = np.full((3, shape.shape[2]), np.nan)
    usual[:, known] = np.nanmedian(shape[:, :, known], axis=1)
    off = shape - usual[:, None]
    spread = np.full(usual.shape, np.nan)
    spread[:, known] = 1.4826 * np.nanmedian(np.abs(off[:, :, known]), axis=1)
    rest = np.nanmedian(spread, axis=1, keepdims=True)
    spread = np.minimum(spread, SHAPES.like_rest * rest)
    few = ~known & (count > 0)
    if few.any():
        off[:, :, few] = shape[:, :, few] - np.nanmedian(usual, axis=1)[:, None, None]
        spread[:, few] = SHAPES.like_rest * rest
    return off, np.maximum(spread, 1e-6)
