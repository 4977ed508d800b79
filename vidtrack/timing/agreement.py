"""One camera's clock by several methods (motion, sound, light): combined, or shown to contradict each other."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.timing.clock import Clock

CONTRADICT = 3.3
"""Two offsets further apart than so many standard errors of their difference (one chance in a thousand) contradict."""

TAKES_PART = 0.05
"""An answer rests on a method without which the variance of offset or rate would be larger by this share or more."""


class Timing(NamedTuple):
    """A camera's clock by one method, with its uncertainty."""

    clock: Clock  # to be given to the camera
    covariance: Array  # (2, 2) of offset and rate, s and ppm; NaN where it cannot be estimated
    n: int = 1  # windows or events that agree
    of: int = 1  # that were looked at

    @property
    def sd(self) -> Clock:
        """Standard errors; NaN where it cannot be estimated."""
        offset, rate = np.sqrt(np.diag(self.covariance)).tolist()
        return Clock(offset, rate)

    @property
    def is_known(self) -> bool:
        """Whether it could be estimated."""
        return bool(np.isfinite(self.covariance).all())

    def moved(self, later_s: float) -> Timing:
        """The same clock, its offset held `later_s` after the moment for which it was given."""
        J = np.array([[1.0, later_s * 1e-6], [0.0, 1.0]])
        offset, rate = (J @ (self.clock.offset_s, self.clock.rate_ppm)).tolist()
        return Timing(Clock(offset, rate), J @ self.covariance @ J.T, self.n, self.of)

    def doubted(self, sd_s: float) -> Timing:
        """The same clock, its offset less sure by `sd_s`, s, the same all along."""
        return self._replace(covariance=self.covariance + np.diag([sd_s**2, 0.0]))


NOT_ESTIMATED = Timing(Clock(), np.full((2, 2), np.nan), 0, 0)
"""The answer where no method gives an estimate."""


class Agreement(NamedTuple):
    """What `agreed` returns."""

    timing: Timing
    used: tuple[str, ...]  # the methods that the answer rests on, the largest weight first
    contradicting: tuple[tuple[str, str], ...]  # pairs of methods, the better one first


def agreed(estimates: Mapping[str, Timing], length_s: float) -> Agreement:
    """One clock from the estimates of several methods.

    estimates  method: offset at the camera's first sample and rate
    length_s   s, of the run; offsets are compared at its middle
    Estimates are weighted by their covariances. One that contradicts a better one is left out, and so is NaN; where
    none is left, the covariance is NaN and the clock is NOT_ESTIMATED.
    """
    sure = {name: own.moved(length_s / 2) for name, own in estimates.items() if own.is_known}
    order = sorted(sure, key=lambda name: sure[name].sd.offset_s)
    contradicting: list[tuple[str, str]] = []
    for better, other in combinations(order, 2):
        apart = abs(sure[better].clock.offset_s - sure[other].clock.offset_s)
        if apart > CONTRADICT * np.hypot(sure[better].sd.offset_s, sure[other].sd.offset_s):
            contradicting.append((better, other))
    accepted: list[str] = []
    for name in order:
        if not any((other, name) in contradicting for other in accepted):
            accepted.append(name)
    if not accepted:
        return Agreement(NOT_ESTIMATED, (), ())
    known = {
        name: np.asarray(np.linalg.inv(sure[name].covariance + np.diag([1e-16, 1e-6])), float) for name in accepted
    }
    covariance = np.linalg.inv(sum(known.values(), np.zeros((2, 2))))
    clocks = {name: np.array([sure[name].clock.offset_s, sure[name].clock.rate_ppm]) for name in accepted}
    at = covariance @ sum((known[name] @ clocks[name] for name in accepted), np.zeros(2))
    share = {name: _share(name, known, covariance) for name in accepted}
    used = sorted((name for name in accepted if share[name] > TAKES_PART), key=lambda name: -share[name])
    n, of = (sum(getattr(sure[name], which) for name in accepted) for which in ("n", "of"))
    timing = Timing(Clock(float(at[0]), float(at[1])), covariance, n, of).moved(-length_s / 2)
    return Agreement(timing, tuple(used), tuple(contradicting))


def _share(name: str, known: Mapping[str, Array], covariance: Array) -> float:
    """Share of the variance of offset or rate without a method by which it is reduced; 1 for a single method."""
    rest = sum((own for other, own in known.items() if other != name), np.zeros((2, 2)))
    if len(known) == 1:
        return 1.0
    return float((1 - np.diag(covariance) / np.diag(np.linalg.inv(rest))).max())
