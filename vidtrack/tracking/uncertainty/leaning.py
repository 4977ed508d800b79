"""How long a camera reads its picture, as moving targets show it that lean: rolling shutters.

A camera that reads its rows one after the other sees each row of a ball a little later than the one above it. With the
velocity (u, v), px a sample, and r samples from one row to the next a circle of the second moments s becomes

    (yy - xx) / s = 2 r v,    2 xy / s = 2 r u

to first order. Motion blur, in proportion to products of velocities, and shapes that go with the place in the picture
(a lens, the oblique view of a sphere, to second order) are fitted beside it. One camera alone shows it, where lines of
sight show nothing: cameras of one height see a target in the same rows, and are late alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.centroiding.streak import drawn_out
from vidtrack.tracking.uncertainty.empirical_sd import spread


@dataclass(frozen=True)
class Leaning:
    """When shapes say how rows are read.

    targets   that are looked at, the fastest
    samples   of each: fewest and most
    rounds    of weighting
    apart     share by which what shapes go with must differ, to be distinguished
    """

    targets: int = 4
    samples: tuple[int, int] = (40, 1000)
    rounds: int = 6
    apart: float = 1e-4


LEANING = Leaning()


class Lean(NamedTuple):
    """How much later a row or column of the picture is seen than the one before it, samples; NaN: not known."""

    later: float
    sd: float


UNKNOWN = Lean(np.nan, np.nan)


def leaning(second: Array, position: Array, velocity: Array, seen: Bools, *, columns: bool = False) -> Lean:
    """What targets (k, n) show of how the picture is read.

    second    (3, k, n) px^2, second moments xx, yy, xy, where they are `seen` (k, n)
    position  (2, k, n) px; velocity (2, k, n) px a sample, NaN where not known
    columns   the picture is read column by column: it was turned
    """
    if columns:
        second, position, velocity = second[[1, 0, 2]], position[::-1], velocity[::-1]
    known = seen & np.isfinite(velocity).all(axis=0)
    speed = np.where(known, np.square(np.nan_to_num(velocity)).sum(axis=0), 0.0).sum(axis=0)
    fast = np.argsort(-speed, kind="stable")[: LEANING.targets]
    each = [
        _of_one(*(values[:, which, target] for values in (second, position, velocity)))
        for target in fast.tolist()
        if (which := spread(np.flatnonzero(known[:, target]), LEANING.samples[1])).size >= LEANING.samples[0]
    ]
    each = [one for one in each if np.isfinite(one.sd) and one.sd > 0]
    if not each:
        return UNKNOWN
    later, weight = np.array([one.later for one in each]), np.array([one.sd for one in each]) ** -2
    mean = float((later * weight).sum() / weight.sum())
    apart = float((weight * (later - mean) ** 2).sum()) / max(len(each) - 1, 1)
    return Lean(mean, float(np.sqrt(max(apart, 1.0) / weight.sum())))


def _of_one(second: Array, position: Array, velocity: Array) -> Lean:
    """What one target of n samples shows."""
    xx, yy, xy = second
    u, v = velocity
    x, y = ((one - one.mean()) / max(float(np.ptp(one)), 1.0) for one in position)
    size, blur = (xx + yy) / 2, drawn_out(velocity)
    shape = np.concatenate([(yy - xx) / size, 2 * xy / size])
    blurred = np.concatenate([(blur[1] - blur[0]) / size, 2 * blur[2] / size])
    place = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    own = np.concatenate([np.hstack([place, 0 * place]), np.hstack([0 * place, place])])
    beside = np.concatenate([blurred[None], own])
    _, much, ways = np.linalg.svd(beside / np.maximum(np.linalg.norm(beside, axis=1, keepdims=True), 1e-12), False)
    lean = np.concatenate([2 * v, 2 * u])
    length = float(np.linalg.norm(lean))
    parts = np.concatenate([lean[None] / max(length, 1e-12), ways[much > LEANING.apart * much[0]]])
    weight, later, sd = np.ones(shape.size), np.nan, np.nan
    for _ in range(LEANING.rounds):
        normal = (parts * weight) @ parts.T
        if not np.linalg.eigvalsh(normal)[0] > LEANING.apart:
            return UNKNOWN
        inverse = np.linalg.inv(normal)
        factors = inverse @ ((parts * weight) @ shape)
        left = np.abs(shape - factors @ parts)
        usual = max(1.4826 * median_of(left), 1e-9)
        weight = 1 / np.maximum(left / (2 * usual), 1.0)
        later, sd = float(factors[0] / length), float(usual * np.sqrt(inverse[0, 0]) / length)
    return Lean(later, sd)
