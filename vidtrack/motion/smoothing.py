"""Position, velocity and acceleration of noisy samples by a spline whose knots are as far apart as the noise asks.

A spline of seventh degree, its knots evenly spaced, is fitted to the record by least squares. Wide spacing
averages much noise and loses fast motion; narrow spacing follows both. The spacing (and for slow motion a single
polynomial of lower degree) is the one that would foretell samples best that it has not seen: generalised
cross-validation (Craven & Wahba 1979), its count of parameters raised by 1.4 against the odd record that it
would follow too closely (Kim & Gu 2004). A least-squares fit knows its own covariance, and so that of every derivative.
Nothing joins the pieces on either side of a gap.

Measured on 24 in at 0.9 Hz, 30 samples a second, noise 0.02 in: velocity 0.06 in/s, acceleration 0.6 in/s^2; by
finite differences 0.5 and 44; by a spline that penalises jerk, as stiff as makes the record most likely, 0.4 and 16.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array

DEGREE = 7
FEWEST = 6
"""Samples in a piece below which no acceleration is told."""
LONGEST_MISSING = 2
"""ASSUME: a piece goes on over this many missing samples in a row; a longer gap parts the record."""
CLOSEST = 1.5
"""Sample intervals, the narrowest spacing of knots that is tried."""
COST = 1.4
"""What a parameter counts for in the cross-validation (Kim & Gu 2004)."""


class Smooth(NamedTuple):
    """A smoothed record at its own sample times; NaN where there was no sample or its piece was too short.

    state   (n, 3)  position, velocity, acceleration: unit of y, and that per s and per s^2
    sd      (n, 3)  their standard deviations: noise, and the motion that wide knots lose (rms over the record)
    noise_sd        of y's samples, as the record tells it (median over samples); the given one where it is known
    noise_ratio     that over the given sigma: 1 where sigma told the truth; NaN where none was given
    spacing_s       s between knots: what happens faster is smoothed away
    piece   (n,)    number of the piece a sample belongs to, -1 for none
    outlier (n,)    samples that the others contradict; they carry no weight
    splines         of every piece: (first time, last time, scipy BSpline)
    """

    state: Array
    sd: Array
    noise_sd: float
    noise_ratio: float
    spacing_s: float
    piece: NDArray[np.intp]
    outlier: NDArray[np.bool_]
    splines: tuple[tuple[float, float, Any], ...]


def smooth(
    t: ArrayLike,
    y: ArrayLike,
    sigma: ArrayLike | None = None,
    *,
    noise: str = "estimated",
    reject: float = 6.0,
) -> Smooth:
    """Smooth one record.

    t       (n,)  s, rising; y (n,) with NaN where a sample is missing
    sigma   scalar or (n,), unit of y, or None
    noise   estimated: sigma is relative, the record tells the rest; known: sigma is believed
    reject  a sample that misses what the others foretell by more than this many sd carries no weight
    Raises ValueError when t does not rise, shapes differ, or the noise is said to be known and no sigma is given.
    """
    time: Array = np.asarray(t, float)
    value: Array = np.asarray(y, float)
    if time.ndim != 1 or time.shape != value.shape or not (np.diff(time) > 0).all():
        raise ValueError("t and y must be (n,) and t must rise")
    if noise not in ("estimated", "known") or (noise == "known" and sigma is None):
        raise ValueError("noise is estimated, or known where sigma is given")
    relative = np.broadcast_to(np.asarray(1.0 if sigma is None else sigma, float), time.shape)
    piece = pieces(time, np.isfinite(value) & np.isfinite(relative) & (relative > 0))
    used = piece >= 0
    outlier = np.zeros(len(time), bool)
    state, sd = np.full((2, len(time), 3), np.nan)
    if not used.any():
        return Smooth(state, sd, np.nan, np.nan, np.nan, piece, outlier, ())
    known = noise == "known"
    weight = np.where(used, relative, np.inf) ** -2.0
    record = _Record(time, value, weight, piece, known)
    plan, fits, factor = record.best()
    outlier[used] = np.abs(record.missed(fits, factor))[used] > reject
    if outlier.any() and outlier.sum() < 0.2 * used.sum():
        record.weight[outlier] = 0.0
        plan, fits, factor = record.best()
    else:
        outlier[:] = False
    lost = record.lost(plan, fits, factor)
    for fit in fits:
        state[fit.rows], sd[fit.rows] = fit.state, np.sqrt(factor**2 * fit.variance + lost**2)
    ends = tuple((float(time[f.rows[0]]), float(time[f.rows[-1]]), f.spline) for f in fits)
    spacing = min(plan[0], record.longest)
    ratio = np.nan if sigma is None else factor
    return Smooth(state, sd, float(factor * np.median(relative[used])), ratio, spacing, piece, outlier, ends)


def pieces(t: Array, good: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The number of the unbroken piece each sample belongs to, (n,); -1 where missing or the piece is too short."""
    number = np.full(len(t), -1, np.intp)
    rows = np.flatnonzero(good)
    if len(rows) < FEWEST:
        return number
    breaks = np.diff(t[rows]) > (LONGEST_MISSING + 1.5) * float(np.median(np.diff(t)))
    label = np.concatenate([[0], np.cumsum(breaks)])
    count = np.bincount(label)
    number[rows] = np.where(count[label] >= FEWEST, label, -1)
    return number


def between(smoothed: Smooth, at: ArrayLike, derivative: int = 0) -> Array:
    """The splines, or a derivative, at any times (m,); NaN outside the pieces."""
    when: Array = np.asarray(at, float)
    answer = np.full(when.shape, np.nan)
    for first, last, spline in smoothed.splines:
        inside = (when >= first) & (when <= last)
        answer[inside] = spline.derivative(derivative)(when[inside]) if derivative else spline(when[inside])
    return answer


class _Fit(NamedTuple):
    rows: NDArray[np.intp]
    state: Array  # (m, 3)
    variance: Array  # (m, 3) for unit factor
    spline: Any


Plan = tuple[float, int]
"""Spacing of knots, s (inf: no knots but the ends), and the degree."""


class _Record:
    """All pieces of one record, which share one plan."""

    def __init__(self, t: Array, y: Array, weight: Array, piece: NDArray[np.intp], known: bool) -> None:
        self.t, self.y, self.weight, self.known = t, y, weight, known
        self.parts = [np.flatnonzero(piece == k) for k in np.unique(piece[piece >= 0])]
        self.longest = max(float(np.ptp(t[rows])) for rows in self.parts)
        self.interval = float(np.median(np.concatenate([np.diff(t[rows]) for rows in self.parts])))

    def best(self) -> tuple[Plan, list[_Fit], float]:
        """The plan that foretells best, its fits, and the factor on sigma."""
        most = _steps(self.longest / (CLOSEST * self.interval))
        plans = [*((np.inf, d) for d in range(2, DEGREE)), *((self.longest / m, DEGREE) for m in most)]
        scores = [self.score(plan) for plan in plans]
        plan, score = min(zip(plans, scores, strict=True), key=lambda pair: pair[1])
        if plan[0] < self.longest:  # look closer between the neighbours
            finer = [(plan[0] * r, DEGREE) for r in (0.8, 0.87, 0.93, 1.08, 1.16, 1.25)]
            plan = min([(score, plan), *((self.score(f), f) for f in finer)])[1]
        fits = self.fits(plan)
        return plan, fits, self.factor(fits)

    def score(self, plan: Plan) -> float:
        """Generalised cross-validation, or Mallows' Cp where the noise is known; the lower the better."""
        misfit, parameters = 0.0, 0
        for rows in self.parts:
            basis = _Basis(self.t[rows], *plan)
            c = basis.coefficients(self.y[rows], self.weight[rows])
            if c is None:
                return np.inf
            misfit += float((self.weight[rows] * (self.y[rows] - basis.at(c)) ** 2).sum())
            parameters += basis.size
        spare = int((self.weight > 0).sum()) - COST * parameters
        if spare <= 0:
            return np.inf
        return misfit + 2 * COST * parameters if self.known else misfit / spare**2

    def fits(self, plan: Plan) -> list[_Fit]:
        return [_Basis(self.t[rows], *plan).fit(rows, self.y[rows], self.weight[rows]) for rows in self.parts]

    def factor(self, fits: list[_Fit]) -> float:
        if self.known:
            return 1.0
        spare = int((self.weight > 0).sum()) - sum(len(fit.spline.c) for fit in fits)
        misfit = sum(float((self.weight[f.rows] * (self.y[f.rows] - f.state[:, 0]) ** 2).sum()) for f in fits)
        return float(np.sqrt(misfit / max(spare, 1)))

    def missed(self, fits: list[_Fit], factor: float) -> Array:
        """Sample minus spline in sd of that difference, (n,); by a robust scale unless the noise is known."""
        missed = np.zeros(len(self.y))
        for fit in fits:
            w = self.weight[fit.rows]
            leverage = np.minimum(w * fit.variance[:, 0], 1 - 1e-6)
            missed[fit.rows] = (self.y[fit.rows] - fit.state[:, 0]) * np.sqrt(w / (1 - leverage))
        used = self.weight > 0
        scale = factor if self.known else 1.4826 * float(np.median(np.abs(missed[used])))
        rounding = 1e-12 * float(np.abs(self.y[used]).max()) * float(np.sqrt(np.median(self.weight[used])))
        return missed / max(scale, rounding, 1e-300)

    def lost(self, plan: Plan, fits: list[_Fit], factor: float) -> Array:
        """Rms motion (3,) that the knots are too far apart to follow: what closer knots add beyond their noise."""
        closer = (plan[0] * 0.75, DEGREE) if np.isfinite(plan[0]) else (np.inf, plan[1] + 1)
        if not np.isfinite(self.score(closer)):
            return np.zeros(3)
        excess, n = np.zeros(3), 0
        for fit, finer in zip(fits, self.fits(closer), strict=True):
            inner = slice(len(fit.rows) // 10, len(fit.rows) - len(fit.rows) // 10)
            more = (finer.state - fit.state) ** 2 - factor**2 * (finer.variance - fit.variance)
            excess += more[inner].sum(0)
            n += len(more[inner])
        return np.sqrt(np.maximum(excess / n, 0.0))


def _steps(most: float) -> list[int]:
    """Numbers of knot intervals to try: 1, 2, 3, then by the factor 1.3."""
    steps, m = [], 1.0
    while m <= max(most, 1.0):
        steps.append(round(m))
        m = max(m + 1, m * 1.3)
    return steps


class _Basis:
    """B-splines on one piece, and their derivatives, at the sample times; sparse."""

    def __init__(self, t: Array, spacing: float, degree: int) -> None:
        from scipy.interpolate import BSpline

        extent = float(t[-1] - t[0])
        intervals = max(1, round(extent / spacing)) if np.isfinite(spacing) else 1
        self.degree = degree = min(degree, len(t) - 2)
        ends = np.full(degree, t[0]), np.full(degree, t[-1])
        self.knots = np.concatenate([ends[0], np.linspace(t[0], t[-1], intervals + 1), ends[1]])
        self.size = intervals + degree
        self.t = t
        matrix = BSpline.design_matrix(t, self.knots, degree)
        # Every sample lies under degree + 1 neighbouring B-splines: their values, and the number of the first.
        self.values: Array = matrix.data.reshape(len(t), degree + 1)
        self.first: NDArray[np.intp] = matrix.indices[:: degree + 1].astype(np.intp)

    def at(self, c: Array) -> Array:
        """The spline at the samples, from its coefficients."""
        return np.asarray((self.values * c[self.first[:, None] + np.arange(self.degree + 1)]).sum(1))

    def _normal(self, weight: Array) -> Array:
        """The lower band of the normal matrix."""
        band = np.zeros((self.degree + 1, self.size))
        for offset in range(self.degree + 1):
            for j in range(self.degree + 1 - offset):
                product = weight * self.values[:, j] * self.values[:, j + offset]
                band[offset] += np.bincount(self.first + j, product, self.size)
        return band

    def _right(self, wy: Array) -> Array:
        columns = (self.first[:, None] + np.arange(self.degree + 1)).ravel()
        return np.bincount(columns, (self.values * wy[:, None]).ravel(), self.size).astype(np.float64)

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

    def fit(self, rows: NDArray[np.intp], y: Array, weight: Array) -> _Fit:
        """Position, velocity and acceleration at the samples and their variances for unit sigma."""
        from scipy.interpolate import BSpline

        c = self.coefficients(y, weight)
        assert c is not None
        inverse = self._inverse(self._normal(weight))
        state, variance = [], []
        for derivative in range(3):
            D = self._derivative(derivative)
            state.append(D @ c)
            variance.append(np.asarray((D @ inverse).multiply(D).sum(axis=1)).ravel())
        return _Fit(rows, np.stack(state, -1), np.stack(variance, -1), BSpline(self.knots, c, self.degree))

    def _derivative(self, order: int) -> Any:
        """The matrix (m, size) that gives the derivative at the samples from the coefficients (de Boor, ch. X)."""
        from scipy.interpolate import BSpline
        from scipy.sparse import diags, eye

        knots, k = self.knots, self.degree
        D: Any = eye(self.size, format="csr")
        for _ in range(order):
            width = knots[k + 1 : -1] - knots[1 : -k - 1]
            step = diags([-k / width, k / width], [0, 1], shape=(len(width), len(width) + 1))
            D, knots, k = step @ D, knots[1:-1], k - 1
        return (BSpline.design_matrix(self.t, knots, k) @ D).tocsr()

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
