"""How long the exposure of a recording was, as the streaks of moving targets show it.

An exposure of T samples draws a moving target out: with the velocity v (px a sample) the second moments grow by
T^2 v v^T / 12. The middle of such a streak is the mean over the exposure, which differs from the position in the middle
of the exposure by T^2/24 times the acceleration.

No exposure is longer than the time from one sample to the next. Targets that are drawn out further are seen in pictures
each of which is a mean of several: by noise reduction over time, a blend from another rate, an editor's smoothing. A
mean of n pictures, short exposures each, has T^2 = n^2 - 1, and shows what moves (n - 1) / 2 pictures late where it
bears the stamp of the last of them. A recursive filter that keeps the share s, T^2 = 12 s / (1 - s)^2, is late by less
than that: s / (1 - s).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.centroiding.streak import drawn_out
from vidtrack.tracking.uncertainty.empirical_sd import spread
from vidtrack.tracking.uncertainty.leaning import UNKNOWN, Lean


@dataclass(frozen=True)
class Exposures:
    """When streaks say how long an exposure was.

    fewest   samples with moments
    at_most  samples that it is estimated from
    longest  exposure, samples, that is corrected
    possible exposure, samples, from which on pictures are means of several: more than a whole one, for what is not
             known of velocities
    sure     standard deviations of its square from which on it is corrected, or impossible
    along    the same of what grows with the speed along the way alone, beside something long that swims lengthwise
    unknown  share of the correction that is not known
    ends     of a streak's length, by which it may be seen further at one end, where it is slower (measured 0.01 to
             0.02 on drawn balls)
    """

    fewest: int = 16
    at_most: int = 50_000
    longest: float = 1.1
    possible: float = 1.35
    sure: float = 6.0
    along: float = 3.0
    unknown: float = 0.3
    ends: float = 0.015


EXPOSURE = Exposures()


class Exposure(NamedTuple):
    """What streaks show, samples.

    square  of the exposure; 0 where it is too short to be seen, or longer than any
    drawn   over so many samples targets are drawn out where that is longer than any exposure; else 0
    """

    square: float
    drawn: float

    @property
    def late(self) -> float:
        """Samples by which what moves is seen late at most."""
        return (float(np.sqrt(self.drawn**2 + 1)) - 1) / 2


class Blur(NamedTuple):
    """What motion does to what is seen of targets, samples.

    exposure  0: too short to be seen; late: by which they are seen late at most, where pictures are mixed
    drawn     as of `Exposure`; lean: how the picture is read
    """

    exposure: float
    late: float
    drawn: float
    lean: Lean = UNKNOWN

    def as_record(self) -> dict[str, Any]:
        """For the record of the tracks."""
        lean = None if np.isnan(self.lean.sd) else self.lean._asdict()
        return {"exposure": self.exposure, "late": self.late, "leaning": lean}


UNSEEN = Exposure(0.0, 0.0)


def exposure_of(second: Array, velocity: Array, acceleration: Array, seen: Bools, lines: int = 1) -> Exposure:
    """The exposure of targets (k, n) with second moments xx, yy, xy (3, k, n) px^2, where those are `seen` (k, n).

    velocity, acceleration  (2, k, n) px a sample and its square, NaN where not known
    lines                   of the frame buffer to a row of a sample: some cameras expose a field for two
    """
    which = spread(np.flatnonzero(seen & np.isfinite(velocity[0] * velocity[1])), EXPOSURE.at_most)
    if which.size < EXPOSURE.fewest:
        return UNSEEN
    moments, way = second.reshape(3, -1)[:, which], velocity.reshape(2, -1)[:, which]
    # what is alike in both directions is the target's size, whatever the distance
    seen_as, made = _unlike(moments), _unlike(drawn_out(way))
    square, sd = _fit(seen_as, made, which.size)
    if not square > EXPOSURE.sure * sd:
        return UNSEEN
    if square <= EXPOSURE.longest**2:
        return Exposure(square, 0.0)
    # by how much they are longer than wide, along their way: what swims lengthwise is as long however slowly it goes
    speed = (way**2).sum(axis=0) / 12
    moves = speed > 0
    longer = (seen_as * made).reshape(2, -1).sum(axis=0)[moves] / speed[moves]
    if longer.size < EXPOSURE.fewest:
        return UNSEEN
    square, sd = _fit(longer, speed[moves], longer.size)
    possible = EXPOSURE.possible * lines / _underestimated(way, acceleration.reshape(2, -1)[:, which])
    if not square > max(EXPOSURE.along * sd, possible**2):
        return UNSEEN
    return Exposure(0.0, float(np.sqrt(square)))


def lateness(velocity: Array, acceleration: Array, exposure: float) -> tuple[Array, Array]:
    """px by which the middle of a streak differs from the position in the middle of its exposure (samples), and one
    standard deviation of that; velocity and acceleration in px a sample and its square.
    """
    late = exposure**2 / 24 * acceleration
    return late, np.hypot(EXPOSURE.unknown * late, EXPOSURE.ends * exposure * velocity)


def _unlike(moments: Array) -> Array:
    """What moments xx, yy, xy (3, n) have that a circle has not, (2 n,)."""
    return np.concatenate([moments[0] - moments[1], 2 * moments[2]])


def _underestimated(velocity: Array, acceleration: Array) -> float:
    """The velocity (2, n) from one sample on either side over the true one, of the swing that has such accelerations.

    Of a swing of w radians a sample, sin w / w, and the acceleration is 2 tan(w / 2) times the velocity.
    """
    known = np.isfinite(acceleration).all(axis=0)
    if not known.any():
        return 1.0
    fast, bent = (float(np.square(one[:, known]).sum()) for one in (velocity, acceleration))
    w = 2 * np.arctan(0.5 * np.sqrt(bent / max(fast, 1e-12)))
    return float(np.sinc(w / np.pi))


def _fit(seen_as: Array, made: Array, half: int) -> tuple[float, float]:
    """The factor of what is `made` (n,) that explains best what is seen (n,), and its standard deviation.

    The first `half` of what is seen have a mean of their own: the target's shape. Weights are Huber's.
    """
    mean = median_of(seen_as[:half])
    weight, square, sd = np.ones(seen_as.size), 0.0, np.inf
    for _ in range(10):
        w = weight * (made != 0)
        a, b = w[:half].sum(), (w[:half] * made[:half]).sum()
        c, d = (w[:half] * seen_as[:half]).sum(), (w * made * made).sum()
        e = (w * made * seen_as).sum()
        determinant = a * d - b * b
        if not determinant > 0:
            return 0.0, np.inf
        mean, square = (c * d - b * e) / determinant, (a * e - b * c) / determinant
        left = seen_as - square * made
        left[:half] -= mean
        usual = max(1.4826 * median_of(np.abs(left)), 1e-9)
        weight = 1 / np.maximum(np.abs(left) / (2 * usual), 1.0)
        sd = usual * np.sqrt(a / determinant)
    return float(square), float(sd)
