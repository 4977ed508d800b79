"""Whether two stretches of one course, with a gap between, are one motion: judged by how this run's targets move.

A polynomial is fitted to the last samples of the one and the first of the other together with a jump in place and in
velocity at the middle of the gap. The jump is a linear function of the samples, so its covariance for true courses is
measured on all stretches of the run that have no gap: no model of the motion is assumed, and noise, waves and throws
count as they are. Of several windows and degrees the one is used whose jumps are smallest, gap by gap. The background
is a jump between two places and velocities of the run taken at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints

LENGTHS = (1, 2, 3, 5, 8, 12, 24, 60)
"""Samples used on a side: the largest of these that hangs together."""
WINDOWS = ((3, 1), (5, 2), (8, 2), (12, 3), (24, 5), (60, 7), (60, 0))
"""Samples on a side and degree of the polynomial that are tried."""
ENOUGH, MOST = 20, 200
"""Stretches that a covariance is measured on, at least and at most."""
LEARNT = (12, 24, 60)
"""Samples before a gap from which the place behind it is predicted by weights that the run itself teaches."""
LEARNT_FROM = 4
"""Moments: in shorter gaps polynomials do as well."""
FINE = 20
"""Moments of a gap up to which each length has a law of its own; longer ones share it with some like them."""
TAIL = 4.0
"""Degrees of freedom of the t distribution of jumps: heavier tails than a normal one, as bounces and releases have."""
FLOOR = -30.0
"""Nats, the least that a jump may tell."""


class _Law(NamedTuple):
    """A jump as a function of samples and what true courses make of it."""

    kx: int
    ky: int
    weights: Array  # (r, kx + ky): jump, and jump of velocity where r is 2
    inverse: Array  # (d r, d r) of the covariance
    log_det: float


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
        self.fastest = float(np.linalg.norm(speed, axis=-1).max(initial=0.0))
        bend = np.diff(places, 2, axis=0)[self._remain[:-2] > 2]
        self.sharpest = float(np.linalg.norm(bend, axis=-1).max(initial=0.0))
        self._place = 2 * _spread(places, d)
        self._speed = 2 * _spread(speed, d)
        self._laws: dict[tuple[int, int, int], _Law | None] = {}

    def evidence(self, before: Array, after: Array, gap: int) -> float:
        """Nats for one course rather than two; 0 where this run tells nothing of such a gap.

        before, after   (k, d) places at consecutive moments; `gap` moments from the last before to the first after
        """
        kx, ky = _length(len(before)), _length(len(after))
        gap = gap if gap <= FINE else round(gap / 10 ** (r := int(np.log10(gap)) - 1)) * 10**r
        key = (kx, ky, gap)
        if key not in self._laws:
            self._laws[key] = self._law(*key)
        law = self._laws[key]
        if law is None:
            return 0.0
        x = np.concatenate([before[-law.kx :], after[: law.ky]])
        jump = (law.weights @ x).ravel()
        n = jump.size
        chi2 = float(jump @ law.inverse @ jump)
        own = _log_t(chi2, law.log_det, n)
        background = self._background(n // self.dimension)
        chi2 = float(jump @ background[0] @ jump)
        return max(own - _log_t(chi2, background[1], n), FLOOR)

    def _background(self, rows: int) -> tuple[Array, float]:
        d = self.dimension
        S = np.zeros((d * rows, d * rows))
        S[:d, :d] = self._place
        if rows > 1:
            S[d:, d:] = self._speed
        return np.linalg.inv(S), float(np.linalg.slogdet(S)[1])

    def _law(self, kx: int, ky: int, gap: int) -> _Law | None:
        best: _Law | None = None
        most = 0.0
        tried = set()
        for window, degree in WINDOWS:
            a, b = min(window, kx), min(window, ky)
            if gap / 2 <= window <= 16 * gap and (a, b, degree) not in tried:
                tried.add((a, b, degree))
                weights = _jump(a, b, degree, gap)
                law = None if weights is None else self._measured(a, b, gap, weights, weights)
                told = 0.0 if law is None else self._background(len(law.weights))[1] - law.log_det
                if told > most:
                    best, most = law, told
        if gap > LEARNT_FROM:
            for k in LEARNT:
                law = self._learnt(k, min(ky, 5), gap) if k <= kx and ky > 1 else None
                told = 0.0 if law is None else self._background(len(law.weights))[1] - law.log_det
                if told > most:
                    best, most = law, told
        return best

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
        # few courses do not tell how different others are; nor may any direction be taken as exact
        apart = int((self._remain >= n).sum()) / n + 1
        S = S * (1 + 10 / apart) + np.eye(len(S)) * (1e-6 * np.trace(S) / len(S) + 1e-30)
        scale = S * (TAIL - 2) / TAIL  # of a t distribution with this covariance
        return _Law(kx, ky, (odd + even) / 2, np.linalg.inv(scale), float(np.linalg.slogdet(scale)[1]))

    def _learnt(self, kx: int, ky: int, gap: int) -> _Law | None:
        """Place and velocity after the gap predicted from kx samples before it, as least squares of this run tell."""
        n = kx + gap - 1 + ky
        starts = self._starts(n)
        if starts.size * self.dimension < 4 * kx:
            return None
        ends = np.concatenate([np.arange(kx), np.arange(n - ky, n)])
        x = self._places[starts[:, None] + ends]
        x = (x - x[:, kx - 1 : kx]).transpose(0, 2, 1)  # (m, d, k) from the last place before
        t = np.arange(ky)
        line = np.linalg.pinv(np.stack([np.ones(ky), t], -1))  # place and velocity (2, ky)
        half = starts.size // 2
        weights = []
        for part in (slice(half, None), slice(0, half)):
            A, y = x[part, :, : kx - 1].reshape(-1, kx - 1), x[part, :, kx:].reshape(-1, ky) @ line.T
            ridge = np.eye(kx - 1) * 1e-6 * np.trace(A.T @ A) / max(kx - 1, 1)
            W = np.linalg.solve(A.T @ A + ridge, A.T @ y).T  # (2, kx - 1)
            last = np.array([1.0, 0.0]) - W.sum(1)
            weights.append(np.concatenate([-W, -last[:, None], line], 1))
        return self._measured(kx, ky, gap, *weights)


def _length(n: int) -> int:
    return max(k for k in LENGTHS if k <= max(n, 1))


def _spread(values: Array, d: int) -> Array:
    if len(values) < 2:
        return np.eye(d)
    S = np.cov(values.T)
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
