"""B-splines on one unbroken piece of a record: least-squares coefficients, derivatives and their variances, sparse."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array


class PieceFit(NamedTuple):
    """A fitted piece: its rows of the record, position, velocity, acceleration, their variances, the spline."""

    rows: NDArray[np.intp]
    state: Array  # (m, 3)
    variance: Array  # (m, 3) for unit factor
    spline: Any


SHORT = 8_000
"""Samples up to which the bases of a piece are kept: those of three coordinates are the same."""


def basis_of(t: Array, spacing: float, degree: int) -> Basis:
    """The basis on a piece; of one that is not too long, the same one again."""
    return _basis(t.tobytes(), spacing, degree) if len(t) <= SHORT else Basis(t, spacing, degree)


@lru_cache(maxsize=128)
def _basis(t: bytes, spacing: float, degree: int) -> Basis:
    return Basis(np.frombuffer(t), spacing, degree)


def forget() -> None:
    """Let go of what is kept: of no use for another record."""
    _basis.cache_clear()


def form_of(t: Array, spacing: float, degree: int) -> tuple[int, int]:
    """Of the basis on a piece, its knot intervals and its degree: their sum is the number of its parameters."""
    intervals = max(1, round(float(t[-1] - t[0]) / spacing)) if np.isfinite(spacing) else 1
    return intervals, min(degree, len(t) - 2)


@cache
def _pairs(degree: int) -> tuple[tuple[int, int], ...]:
    """Pairs of the B-splines over a sample, the lower and the upper of each; those of equal distance together."""
    n = degree + 1
    return tuple((j, j + offset) for offset in range(n) for j in range(n - offset))


def _design(t: Array, knots: Array, degree: int) -> Any:
    """The B-splines at times between the ends of the knots, sparse; that they are between need not be looked at."""
    from scipy.interpolate import BSpline

    return BSpline.design_matrix(t, knots, degree, extrapolate=True)


class Basis:
    """B-splines on one piece, and their derivatives, at the sample times; sparse."""

    def __init__(self, t: Array, spacing: float, degree: int) -> None:
        intervals, degree = form_of(t, spacing, degree)
        self.degree = degree
        ends = np.full(degree, t[0]), np.full(degree, t[-1])
        self.knots = np.concatenate([ends[0], np.linspace(t[0], t[-1], intervals + 1), ends[1]])
        self.size = intervals + degree
        self.t = t
        matrix = _design(t, self.knots, degree)
        # Every sample lies under degree + 1 neighbouring B-splines: their values, and the number of the first.
        self.values: Array = matrix.data.reshape(len(t), degree + 1)
        self._first: NDArray[np.intp] = matrix.indices[:: degree + 1].astype(np.intp)
        self._columns: NDArray[np.intp] = self._first[:, None] + np.arange(degree + 1)
        self._each: Array = np.ascontiguousarray(self.values.T)

    def at(self, c: Array) -> Array:
        """The spline at the samples, from its coefficients."""
        return np.asarray((self.values * c[self._columns]).sum(1))

    def _normal(self, weight: Array) -> Array:
        """The lower band of the normal matrix."""
        weighted = weight * self._each
        band = np.zeros((self.degree + 1, self.size))
        for j, other in _pairs(self.degree):
            sums = np.bincount(self._first, weighted[j] * self._each[other])
            band[other - j, j : j + len(sums)] += sums
        return band

    def _right(self, wy: Array) -> Array:
        return np.asarray(np.bincount(self._columns.ravel(), (self.values * wy[:, None]).ravel(), self.size), float)

    def coefficients(self, y: Array, weight: Array) -> Array | None:
        """Least squares; None where some B-spline has no sample to hold it."""
        from scipy.linalg import LinAlgError, solveh_banded

        band = self._normal(weight)
        if self.size > int((weight > 0).sum()) or band[0].min() <= 1e-9 * band[0].max():
            return None
        try:
            c: Array = solveh_banded(band, self._right(weight * y), lower=True, check_finite=False)
            return c
        except LinAlgError:
            return None

    def fit(self, rows: NDArray[np.intp], y: Array, weight: Array) -> PieceFit:
        """Position, velocity and acceleration at the samples and their variances for unit sigma."""
        from scipy.interpolate import BSpline

        c = self.coefficients(y, weight)
        if c is None:
            raise ValueError(f"{len(rows)} samples cannot hold a spline of {self.size} coefficients")
        inverse = self._inverse(self._normal(weight))
        state, variance = [], []
        for derivative in range(3):
            D = self._derivative(derivative)
            state.append(D @ c)
            variance.append(np.asarray((D @ inverse).multiply(D).sum(axis=1)).ravel())
        return PieceFit(rows, np.stack(state, -1), np.stack(variance, -1), BSpline(self.knots, c, self.degree))

    def _derivative(self, order: int) -> Any:
        """The matrix (m, size) that gives the derivative at the samples from the coefficients (de Boor, ch. X)."""
        from scipy.sparse import diags, eye

        knots, k = self.knots, self.degree
        D: Any = eye(self.size, format="csr")
        for _ in range(order):
            width = knots[k + 1 : -1] - knots[1 : -k - 1]
            step = diags([-k / width, k / width], [0, 1], shape=(len(width), len(width) + 1))
            D, knots, k = step @ D, knots[1:-1], k - 1
        return (_design(self.t, knots, k) @ D).tocsr()

    def _inverse(self, band: Array) -> Any:
        """The inverse of the normal matrix within its band, sparse.

        Elements die away by half a knot (B-splines of seventh degree), so unit vectors 70 apart share one solve.
        """
        from scipy.linalg import cho_solve_banded, cholesky_banded
        from scipy.sparse import csr_matrix

        factor = cholesky_banded(band, lower=True, check_finite=False)
        apart = min(self.size, 70)
        unit = np.zeros((self.size, apart))
        columns = np.arange(self.size)
        unit[columns, columns % apart] = 1
        answer = cho_solve_banded((factor, True), unit, check_finite=False)
        offset = np.arange(-self.degree, self.degree + 1)
        i = columns[:, None] + offset
        inside = (i >= 0) & (i < self.size)
        j = np.broadcast_to(columns[:, None], i.shape)[inside]
        i = i[inside]
        return csr_matrix((answer[i, j % apart], (i, j)), shape=(self.size, self.size))
