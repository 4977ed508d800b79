"""B-splines on one unbroken piece of a record: least-squares coefficients, derivatives and their variances, sparse."""

from __future__ import annotations

from collections.abc import Iterator
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


SHORT, KEPT = 8_000, 1_000_000
"""Samples up to which the basis of a piece is kept, and of all that are: those of three coordinates are the same."""

AT_ONCE = 4096
"""Samples of which the covariances are taken out at once."""

_kept: dict[tuple[bytes, int, int], Basis] = {}


def basis_of(t: Array, spacing: float, degree: int) -> Basis:
    """The basis on a piece; of one that is not too long, the same one again."""
    if len(t) > SHORT:
        return Basis(t, spacing, degree)
    key = (t.tobytes(), *form_of(t, spacing, degree))
    if (basis := _kept.pop(key, None)) is None:
        basis = Basis(t, spacing, degree)
        left = KEPT - len(t) - sum(len(own.t) for own in _kept.values()) if len(_kept) >= KEPT // SHORT else 0
        while left < 0:  # those that were wanted last longest ago
            left += len(_kept.pop(next(iter(_kept))).t)
    _kept[key] = basis
    return basis


def forget() -> None:
    """Let go of what is kept: of no use for another record."""
    _kept.clear()


def form_of(t: Array, spacing: float, degree: int) -> tuple[int, int]:
    """Of the basis on a piece, its knot intervals and its degree: their sum is the number of its parameters."""
    intervals = max(1, round(float(t[-1] - t[0]) / spacing)) if np.isfinite(spacing) else 1
    return intervals, min(degree, len(t) - 2)


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
        self._sums = _Sums(self._first, intervals, self.values)

    def at(self, c: Array) -> Array:
        """The spline at the samples, from its coefficients."""
        return np.asarray((self.values * c[self._columns]).sum(1))

    def _normal(self, weight: Array) -> Array:
        """The lower band of the normal matrix."""
        band = np.zeros((self.degree + 1, self.size))
        for j, sums in enumerate(self._sums.of_pairs(weight)):
            band[: len(sums), j : j + sums.shape[1]] += sums
        return band

    def _right(self, wy: Array) -> Array:
        return np.asarray(np.bincount(self._columns.ravel(), (self.values * wy[:, None]).ravel(), self.size), float)

    def coefficients(self, y: Array, weight: Array) -> Array | None:
        """Least squares; None where some B-spline has no sample to hold it."""
        return self._solved(self._normal(weight), y, weight)

    def _solved(self, band: Array, y: Array, weight: Array) -> Array | None:
        from scipy.linalg.lapack import dpbsv

        if self.size > int((weight > 0).sum()) or band[0].min() <= 1e-9 * band[0].max():
            return None
        _, c, failed = dpbsv(band, self._right(weight * y), lower=1, overwrite_b=1)
        return None if failed else np.asarray(c)

    def fit(self, rows: NDArray[np.intp], y: Array, weight: Array) -> PieceFit:
        """Position, velocity and acceleration at the samples and their variances for unit sigma."""
        from scipy.interpolate import BSpline

        band = self._normal(weight)
        c = self._solved(band, y, weight)
        if c is None:
            raise ValueError(f"{len(rows)} samples cannot hold a spline of {self.size} coefficients")
        blocks = self._inverse(band)
        state, variance = np.empty((2, len(rows), 3))
        steps = [self._steps(derivative) for derivative in range(3)]
        for some in (slice(i, i + AT_ONCE) for i in range(0, len(rows), AT_ONCE)):
            over = c[self._columns[some]].T
            under = blocks[:, :, self._first[some]]
            for derivative, own in enumerate(steps):
                D, order = self._derivative(own, some), _order(derivative, self.degree)
                state[some, derivative] = _in_order(D * over, order)
                half = D[order[0]] * under[order[0]]
                for k in order[1:]:
                    half += D[k] * under[k]
                variance[some, derivative] = _total(half * D)
        return PieceFit(rows, state, variance, BSpline(self.knots, c, self.degree))

    def _steps(self, order: int) -> tuple[Array, Array]:
        """What each B-spline of a derivative is of those of its degree, (order + 1, ...), and their knots."""
        knots, k = self.knots, self.degree
        steps = np.ones((1, self.size))
        for _ in range(order):
            width = knots[k + 1 : -1] - knots[1 : -k - 1]
            finer = np.zeros((len(steps) + 1, len(width)))
            finer[:-1] = -k / width * steps[:, :-1]
            finer[1:] += k / width * steps[:, 1:]
            steps, knots, k = finer, knots[1:-1], k - 1
        return steps, knots

    def _derivative(self, of: tuple[Array, Array], some: slice) -> Array:
        """What each B-spline over some samples gives to a derivative there, (degree + 1, m) (de Boor, ch. X).

        of   see `_steps`
        """
        steps, knots = of
        if len(steps) == 1:
            return np.ascontiguousarray(self.values[some].T)
        t, first, k = self.t[some], self._first[some], self.degree + 1 - len(steps)
        values = _design(t, knots, k).data.reshape(len(t), k + 1)
        D = np.zeros((self.degree + 1, len(t)))
        for a, own in enumerate(np.ascontiguousarray(values.T)):
            for i, step in enumerate(steps):
                D[a + i] += own * step.take(first + a)
        return D

    def _inverse(self, band: Array) -> Array:
        """The inverse of the normal matrix, for each interval between knots the part of the B-splines over it.

        (degree + 1, degree + 1, intervals). Elements die away by half a knot (B-splines of seventh degree), so unit
        vectors 70 apart share one solve.
        """
        from scipy.linalg import cho_solve_banded, cholesky_banded

        factor = cholesky_banded(band, lower=True, check_finite=False)
        apart = min(self.size, 70)
        unit = np.zeros((self.size, apart), order="F")
        columns = np.arange(self.size)
        unit[columns, columns % apart] = 1
        answer = cho_solve_banded((factor, True), unit, overwrite_b=True, check_finite=False)
        over = np.arange(self.degree + 1)[:, None] + np.arange(self.size - self.degree)
        return np.asarray(answer[over[:, None], over % apart])


class _Sums:
    """Sums over the samples between two knots, of products of the B-splines there.

    first      (m,) the number of the interval of each sample, rising
    intervals  how many there are
    values     (m, n) of the n B-splines over each sample

    Each sum is made in the order of the samples. Where the intervals hold about as many each, they are summed side by
    side, in a table that is filled up with zeros, which change no sum.
    """

    def __init__(self, first: NDArray[np.intp], intervals: int, values: Array) -> None:
        m, n = values.shape
        count = np.bincount(first, minlength=intervals)
        self._first, self._shape, self._place = first, (int(count.max()), intervals), None
        self._values = np.ascontiguousarray(values.T)
        # one interval alone is not summed in the order of its samples by numpy's `add`; many samples each: no gain
        if m <= SHORT and intervals > 1 and self._shape[0] <= 100 and self._shape[0] * intervals <= 2 * m:
            begin = np.cumsum(count) - count
            self._place = (np.arange(m) - begin[first]) * intervals + first
            self._values = np.zeros((n, self._shape[0] * intervals))
            self._values[:, self._place] = values.T

    def of_pairs(self, weight: Array) -> Iterator[Array]:
        """Weighted sums (pairs, intervals) of products: of the first with itself, the second, ...; of the second ...

        weight (m,)
        """
        if self._place is None:
            for j, own in enumerate(self._values):
                weighted = weight * own
                others = self._values[j:]
                yield np.array([np.bincount(self._first, weighted * other, self._shape[1]) for other in others])
            return
        table = np.zeros(self._values.shape[1])
        table[self._place] = weight
        for j, own in enumerate(self._values):  # one at a time: what it needs stays in the second-level cache
            products = ((table * own) * self._values[j:]).reshape(-1, *self._shape)
            yield np.add.reduce(products, axis=1)


def _order(derivative: int, degree: int) -> list[int]:
    """The order in which the shares over a sample are added up: to the bit, that of earlier versions."""
    whole = [*range(degree, -1, -1)]
    return {0: whole, 1: [*whole[:-2], 0, 1], 2: [*whole[:-3], 1, 0, 2]}[derivative]


def _in_order(parts: Array, order: list[int]) -> Array:
    """The sum over the first axis, in an order that is given."""
    total: Array = parts[order[0]].copy()
    for k in order[1:]:
        total += parts[k]
    return total


def _total(parts: Array) -> Array:
    """The sum over the first axis: the first that is not 0, and the sum of all others, each in its turn."""
    total = parts[0] + _in_order(parts, [*range(1, len(parts))])
    for column in np.flatnonzero((parts == 0).any(0)):
        first, *others = parts[parts[:, column] != 0, column]
        total[column] = first + sum(others)
    return np.asarray(total)
