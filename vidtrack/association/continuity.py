"""Whether two stretches of one course, with a gap between, are one motion: judged by how this run's targets move.

A polynomial is fitted to the last samples of the one and the first of the other together with a jump in place and in
velocity at the middle of the gap. The jump is a linear function of the samples, so its covariance for true courses is
measured on all stretches of the run that have no gap: no model of the motion is assumed, and noise, waves and throws
count as they are. Of several windows and degrees the one is used whose jumps are smallest, gap by gap. The background
is a jump between two places and velocities of the run taken at random.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints

LENGTHS = (1, 2, 3, 5, 8, 12, 24, 60)
"""Samples used on a side: the largest of these without a gap."""
WINDOWS = ((3, 1), (5, 2), (5, 3), (8, 2), (8, 4), (12, 3), (12, 5), (24, 5), (24, 7), (60, 7), (60, 0))
"""Samples on a side and degree of the polynomial that are tried."""
ENOUGH, MOST = 20, 200
"""Stretches that a covariance is measured on, at least and at most."""
LEARNT = (8, 12, 24, 60)
"""Samples on one side of a gap from which the place on the other one is predicted by weights fitted to the run."""
FINE = 20
"""Moments of a gap up to which each length has a law of its own; longer ones share it with some like them."""
TAIL = 4.0
"""Degrees of freedom of the t distribution of jumps: heavier tails than a normal one, as bounces and releases have."""
BOUNCES = 1
"""Moments of a gap up to which a target may have bounced in it: longer ones may hide that two passed each other."""
BOUNCE = -2.0
"""# ASSUME: nats for a bounce at a seam, which leaves the place continuous and the velocity free: log of the share of
seams that are one, over the share of moments at which another target would just happen to begin."""
FLOOR = -30.0
"""Nats, the least that a jump may be worth: less than LASTING, as a target may bounce while it is not seen."""


class Evidence(NamedTuple):
    """What a motion says of two stretches."""

    nats: float  # for one course rather than two; 0 where this run says nothing of such a gap
    information: float  # nats by which one course narrows the jump, whatever the jump is; 0 where nothing is known


UNKNOWN = Evidence(0.0, 0.0)


class _Law(NamedTuple):
    """A jump as a function of samples and what true courses make of it."""

    kx: int
    ky: int
    weights: Array  # (r, kx + ky): jump, and jump of velocity where r is 2
    inverse: Array  # (d r, d r) of the covariance
    log_det: float
    information: float  # nats, as of Evidence


class Motion:
    """How targets of a run move, from stretches (L, d) of places at consecutive moments; d = 3, or 2 in a plane."""

    def __init__(self, stretches: Sequence[Array]) -> None:
        d = stretches[0].shape[1] if len(stretches) else 3
        self.dimension = d
        places = np.concatenate(stretches) if len(stretches) else np.zeros((0, d))
        lengths = np.array([len(s) for s in stretches], np.intp)
        self._places = places
        # samples of the same stretch from each one on, itself counted
        self._remain = np.repeat(np.cumsum(lengths), lengths) - np.arange(len(places))
        speed = np.diff(places, axis=0)[self._remain[:-1] > 1]
        self.fastest = _longest(speed)
        bend = np.diff(places, 2, axis=0)[self._remain[:-2] > 2]
        self.sharpest = _longest(bend)
        self._backgrounds = [_background(_spread(places, d), _spread(speed, d), rows) for rows in (1, 2)]
        self._laws: dict[tuple[int, int, int], _Law | None] = {}
        self._steps: dict[int, _Law | None] = {}
        self._tried: dict[tuple[object, ...], _Law | None] = {}

    def evidence(self, before: Array, after: Array, gap: int) -> Evidence:
        """What this run says of one course that was not seen for a while.

        before, after   (k, d) places at consecutive moments; `gap` moments from the last before to the first after
        """
        kx, ky = _length(len(before)), _length(len(after))
        gap = gap if gap <= FINE else round(gap / 10 ** (r := int(np.log10(gap)) - 1)) * 10**r
        key = (kx, ky, gap)
        if key not in self._laws:
            self._laws[key] = max(self._candidates(*key), key=lambda law: law.information, default=None)
        law = self._laws[key]
        if law is None:
            return UNKNOWN
        x = np.concatenate([before[-law.kx :], after[: law.ky]])
        jump = (law.weights @ x).ravel()
        n = jump.size
        own = _log_t(float(jump @ law.inverse @ jump), law.log_det, n)
        inverse, log_det = self._backgrounds[n // self.dimension - 1]
        other = _log_t(float(jump @ inverse @ jump), log_det, n)
        return Evidence(max(own - other, self._bounced(after[0] - before[-1], gap), FLOOR), law.information)

    def _bounced(self, step: Array, gap: int) -> float:
        """Nats for one target that bounced in the gap: what its step (d,) in place says, whatever its velocity is."""
        if gap > BOUNCES:
            return -np.inf
        if gap not in self._steps:
            step_of = np.array([[-1.0, 1.0]])
            self._steps[gap] = self._measured(1, 1, gap, step_of, step_of)
        law = self._steps[gap]
        if law is None:
            return -np.inf
        inverse, log_det = self._backgrounds[0]
        own = _log_t(float(step @ law.inverse @ step), law.log_det, step.size)
        return BOUNCE + own - _log_t(float(step @ inverse @ step), log_det, step.size)

    def _candidates(self, kx: int, ky: int, gap: int) -> Iterator[_Law]:
        """Laws for so many samples on the sides of a gap that say anything, by polynomials and by prediction."""
        forms: list[tuple[Callable[..., _Law | None], tuple[int, int, int]]] = []
        for window, degree in WINDOWS:
            if gap / 2 <= window <= 16 * gap:
                forms.append((self._by_polynomial, (min(window, kx), min(window, ky), degree)))
        for k in LEARNT:
            if k <= kx:
                forms.append((self._predicted, (k, min(ky, 5), 1)))
            if k <= ky:
                forms.append((self._predicted, (min(kx, 5), k, -1)))
        for form in forms:
            key = (*form, gap)
            if key not in self._tried:
                self._tried[key] = form[0](*form[1], gap)
            law = self._tried[key]
            if law is not None and law.information > 0:
                yield law

    def _by_polynomial(self, kx: int, ky: int, degree: int, gap: int) -> _Law | None:
        weights = _jump(kx, ky, degree, gap)
        return None if weights is None else self._measured(kx, ky, gap, weights, weights)

    def _starts(self, n: int) -> Ints:
        """Where stretches of n samples begin, at most MOST of them; none where there are fewer than ENOUGH."""
        starts = np.flatnonzero(self._remain >= n)
        if starts.size < ENOUGH:
            return starts[:0]
        return starts[:: max(1, starts.size // MOST)]

    def _measured(self, kx: int, ky: int, gap: int, odd: Array, even: Array) -> _Law | None:
        """What true courses make of a jump; those of the odd half of the run by its own weights, so of the even one."""
        n = kx + gap - 1 + ky
        starts = self._starts(n)
        if not starts.size:
            return None
        ends = np.concatenate([np.arange(kx), np.arange(n - ky, n)])
        x = self._places[starts[:, None] + ends]
        half = starts.size // 2
        jumps = np.concatenate(
            [np.einsum("rk,mkd->mrd", odd, x[:half]), np.einsum("rk,mkd->mrd", even, x[half:])]
        ).reshape(starts.size, -1)
        S = jumps.T @ jumps / len(jumps)
        # few courses do not show how different others are, and least of all how place and velocity go together:
        # where they are fewer than the covariance has directions, courses without any correlation make up for them
        apart = int((self._remain >= n).sum()) / n + 1
        prior = max(len(S) + 1 - apart, 0.0)
        S = (apart * S + prior * np.diag(np.diag(S))) / (apart + prior)
        S = S * (1 + 10 / apart) + np.eye(len(S)) * (1e-6 * np.trace(S) / len(S) + 1e-30)
        scale = S * (TAIL - 2) / TAIL  # of a t distribution with this covariance
        log_det = float(np.linalg.slogdet(scale)[1])
        information = (self._backgrounds[len(odd) - 1][1] - log_det) / 2
        return _Law(kx, ky, (odd + even) / 2, np.linalg.inv(scale), log_det, information)

    def _predicted(self, kx: int, ky: int, way: int, gap: int) -> _Law | None:
        """Place and velocity on one side of the gap predicted from the other one, by least squares over this run.

        way   1: those after the gap from kx samples before it; -1: those before it from ky samples after it
        """
        n = kx + gap - 1 + ky
        starts = self._starts(n)
        known, other = (kx, ky) if way > 0 else (ky, kx)
        if starts.size * self.dimension < 4 * known:
            return None
        ends = np.concatenate([np.arange(kx), np.arange(n - ky, n)])[::way]
        x = self._places[starts[:, None] + ends]
        x = (x - x[:, known - 1 : known]).transpose(0, 2, 1)  # (m, d, k) from the last place that is known
        line = np.linalg.pinv(np.vander(np.arange(other), min(other, 2), increasing=True))  # place, velocity
        half = starts.size // 2
        weights = []
        for part in (slice(half, None), slice(0, half)):
            A, y = x[part, :, : known - 1].reshape(-1, known - 1), x[part, :, known:].reshape(-1, other) @ line.T
            ridge = np.eye(known - 1) * 1e-6 * np.trace(A.T @ A) / max(known - 1, 1)
            W = np.linalg.solve(A.T @ A + ridge + 1e-300 * np.eye(known - 1), A.T @ y).T
            last = np.eye(len(line))[0] - W.sum(1)
            weights.append(np.concatenate([-W, -last[:, None], line], 1)[:, ::way])
        return self._measured(kx, ky, gap, *weights)


def _longest(steps: Array) -> float:
    """Length of the longest of steps (n, d); 0 where there is none."""
    square = np.zeros(len(steps))
    for along in steps.T:
        square += along * along
    return float(np.sqrt(square.max(initial=0.0)))


def _length(n: int) -> int:
    return max(k for k in LENGTHS if k <= max(n, 1))


def _background(place: Array, speed: Array, rows: int) -> tuple[Array, float]:
    """Inverse and log-determinant of the covariance of a jump between two places, and velocities, taken at random."""
    d = len(place)
    S = np.zeros((d * rows, d * rows))
    S[:d, :d] = 2 * place
    if rows > 1:
        S[d:, d:] = 2 * speed
    return np.asarray(np.linalg.inv(S), float), float(np.linalg.slogdet(S)[1])


def _spread(values: Array, d: int) -> Array:
    if len(values) < 2:
        return np.eye(d)
    # as np.cov, whose mean of so short rows takes several times as long
    off = values - np.array([np.cumsum(along)[-1] for along in values.T]) / len(values)
    S = (off.T @ off) * np.true_divide(1, len(off) - 1)
    return np.asarray(S + np.eye(d) * (1e-3 * np.trace(S) / d + 1e-30))


def _log_t(chi2: float, log_det: float, n: int) -> float:
    """Log density of a t distribution of TAIL degrees in n dimensions, but for what all of the same n share."""
    return -0.5 * log_det - 0.5 * (TAIL + n) * float(np.log1p(chi2 / TAIL))


@lru_cache(maxsize=4096)
def _jump(kx: int, ky: int, degree: int, gap: int) -> Array | None:
    """Weights (r, kx + ky) of samples in the jump and the jump of velocity, per moment; None for too few samples."""
    both = min(kx, ky) > 1
    if kx + ky < degree + 2 + both:
        return None
    t = np.concatenate([np.arange(1 - kx, 1), gap + np.arange(ky)]) - gap / 2
    scale = np.abs(t).max()
    columns = [(t / scale) ** p for p in range(degree + 1)]
    side = np.sign(t)
    columns.append(side / 2)
    if both:
        # a change of velocity: the other coefficients take its mean
        columns.append(np.abs(t) / 2)
    A = np.stack(columns, -1)
    if np.linalg.matrix_rank(A, tol=1e-9) < A.shape[1]:
        return None
    return np.asarray(np.linalg.pinv(A)[degree + 1 :])
