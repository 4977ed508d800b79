"""Position, velocity and acceleration of noisy samples by a spline whose knots are as far apart as the noise asks.

A spline of seventh degree, its knots evenly spaced, is fitted to the record by least squares. Wide spacing
averages much noise and loses fast motion; narrow spacing follows both. The spacing (and for slow motion a single
polynomial of lower degree) is the one that would predict samples best that it has not seen: generalised
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
from vidtrack.motion.impacts import velocity_jumps
from vidtrack.motion.spline_basis import PieceFit, basis_of, form_of

DEGREE = 7
FEWEST = 6
"""Samples in a piece below which no acceleration is estimated."""
LONGEST_MISSING = 2
"""ASSUME: a piece goes on over this many missing samples in a row; a longer gap parts the record."""
CLOSEST = 1.5
"""Sample intervals, the narrowest spacing of knots that is tried."""
ENDS, APART = 2, 3
"""Samples at an end of a piece that are never outliers, and from one outlier to the next."""
MOST_OUTLIERS = 0.2
"""Share of outliers beyond which it is the spline that errs."""
IMPACT_SD = (30.0, 15.0, 8.0)
"""Jumps of velocity, in sd, at which it is tried to split the record."""
COST = 1.4
"""What a parameter counts for in the cross-validation (Kim & Gu 2004)."""


class Smooth(NamedTuple):
    """A smoothed record at its own sample times; NaN where there was no sample or its piece was too short.

    state   (n, 3)  position, velocity, acceleration: unit of y, and that per s and per s^2
    sd      (n, 3)  their standard deviations: noise, and the motion that wide knots lose (rms over the record)
    noise_sd        of y's samples, as estimated from the record (median over samples); the given one where it is known
    noise_ratio     that over the given sigma: 1 where sigma is right; NaN where none was given
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
    impacts: bool = False,
) -> Smooth:
    """Smooth one record.

    t       (n,)  s, rising; y (n,) with NaN where a sample is missing
    sigma   scalar or (n,), unit of y, or None
    noise   estimated: sigma is relative, its scale is estimated from the record; known: sigma is used as it is
    reject  a single sample that misses what the others predict by more than this many sd carries no weight. Where
            several in a row do, the spline is too stiff, and none is left out
    impacts whether the record is split where the velocity jumps (see `velocity_jumps`)
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
    outlier = record.outliers(*record.best()[:1], reject)
    record = record.without(outlier)
    if impacts:
        record = record.split_at_impacts()
        piece = record.piece
    plan, fits, factor = record.best()
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


Plan = tuple[float, int]
"""Spacing of knots, s (inf: no knots but the ends), and the degree."""


class _Record:
    """All pieces of one record, which share one plan."""

    def __init__(self, t: Array, y: Array, weight: Array, piece: NDArray[np.intp], known: bool) -> None:
        self.t, self.y, self.weight, self.piece, self.known = t, y, weight, piece, known
        self.parts = [np.flatnonzero(piece == k) for k in np.unique(piece[piece >= 0])]
        self.times = [t[rows] for rows in self.parts]
        self.longest = max(float(np.ptp(own)) for own in self.times)
        self.interval = float(np.median(np.concatenate([np.diff(own) for own in self.times])))
        self._scores: dict[Plan, float] = {}
        self._fits: dict[Plan, list[PieceFit]] = {}

    def without(self, outlier: NDArray[np.bool_]) -> _Record:
        """The same record, some of its samples without weight."""
        if not outlier.any():
            return self
        return _Record(self.t, self.y, np.where(outlier, 0.0, self.weight), self.piece, self.known)

    def outliers(self, plan: Plan, reject: float) -> NDArray[np.bool_]:
        """Single samples (n,) that the others contradict: without them their neighbours fit.

        The end samples of a piece never are: beyond the others nothing predicts them.
        """
        fits = self.fits(plan)
        missed = np.abs(self.missed(fits, self.factor(fits)))
        tried = np.zeros(len(self.y), bool)
        for rows in self.parts:
            inner = rows[ENDS:-ENDS]
            inner = inner[missed[inner] > reject]
            for row in inner[np.argsort(-missed[inner])]:
                near = slice(max(row - APART, 0), row + APART + 1)
                if not tried[near].any():
                    tried[row] = True
        if not tried.any() or tried.sum() > MOST_OUTLIERS * (self.weight > 0).sum():
            return np.zeros(len(self.y), bool)
        rest = self.without(tried)
        fits = rest.fits(plan)
        again = np.abs(rest.missed(fits, rest.factor(fits)))
        for row in np.flatnonzero(tried):
            near = slice(max(row - APART, 0), row + APART + 1)
            off = abs(self.y[row] - _at_sample(fits, int(row))) * np.sqrt(self.weight[row])
            tried[row] = again[near].max() <= reject and off > reject * rest.factor(fits)
        return tried

    def split_at_impacts(self) -> _Record:
        """The record, its pieces split at impacts where that predicts samples better."""
        best, lowest = self, self.lowest()
        size = np.zeros(len(self.t))
        for rows in self.parts:
            size[rows] = velocity_jumps(self.t[rows], self.y[rows], self.weight[rows])
        tried = 0
        for least in IMPACT_SD:
            impacts = np.flatnonzero(size > least)
            if len(impacts) == tried:  # the same ones again
                continue
            tried, piece = len(impacts), self.piece.copy()
            for row in impacts:
                piece[row:] = np.where(piece[row:] == piece[row], piece.max() + 1, piece[row:])
            split = _Record(self.t, self.y, self.weight, piece, self.known)
            score = split.lowest(lowest)
            if score < lowest:
                best, lowest = split, score
        return best

    def lowest(self, least: float = np.inf) -> float:
        """The score of the best plan; `least` where each has more."""
        for plan in self.plans():
            least = min(least, self.score(plan, least))
        return least

    def plans(self) -> list[Plan]:
        most = _steps(self.longest / (CLOSEST * self.interval))
        return [*((np.inf, d) for d in range(2, DEGREE)), *((self.longest / m, DEGREE) for m in most)]

    def best(self) -> tuple[Plan, list[PieceFit], float]:
        """The plan that predicts best, its fits, and the factor on sigma."""
        plans = self.plans()
        scores = [self.score(plan) for plan in plans]
        plan, score = min(zip(plans, scores, strict=True), key=lambda pair: pair[1])
        if plan[0] < self.longest:  # look closer between the neighbours
            finer = [(plan[0] * r, DEGREE) for r in (0.8, 0.87, 0.93, 1.08, 1.16, 1.25)]
            plan = min([(score, plan), *((self.score(f), f) for f in finer)])[1]
        fits = self.fits(plan)
        return plan, fits, self.factor(fits)

    def score(self, plan: Plan, limit: float = np.inf) -> float:
        """Generalised cross-validation, or Mallows' Cp where the noise is known; the lower the better.

        limit   beyond it the score may be infinite: it rises from piece to piece, and need not be known to the end
        """
        if plan not in self._scores:
            score = self._scored(plan, limit)
            if not score > limit:
                self._scores[plan] = score
            return score
        return self._scores[plan]

    def _scored(self, plan: Plan, limit: float) -> float:
        parameters = sum(sum(form_of(own, *plan)) for own in self.times)
        spare = int((self.weight > 0).sum()) - COST * parameters
        if spare <= 0:
            return np.inf
        misfit, score = 0.0, np.inf
        for rows, own in zip(self.parts, self.times, strict=True):
            basis, y, weight = basis_of(own, *plan), self.y[rows], self.weight[rows]
            c = basis.coefficients(y, weight)
            if c is None:
                return np.inf
            misfit += float((weight * (y - basis.at(c)) ** 2).sum())
            score = misfit + 2 * COST * parameters if self.known else misfit / spare**2
            if score > limit:
                return np.inf
        return score

    def fits(self, plan: Plan) -> list[PieceFit]:
        if plan not in self._fits:
            self._fits[plan] = [self._fit(rows, plan) for rows in self.parts]
        return self._fits[plan]

    def _fit(self, rows: NDArray[np.intp], plan: Plan) -> PieceFit:
        """The fit of one piece; by a parabola where it holds too few samples for the plan."""
        basis, y, weight = basis_of(self.t[rows], *plan), self.y[rows], self.weight[rows]
        if basis.coefficients(y, weight) is None:
            basis = basis_of(self.t[rows], np.inf, 2)
        return basis.fit(rows, y, weight)

    def factor(self, fits: list[PieceFit]) -> float:
        if self.known:
            return 1.0
        spare = int((self.weight > 0).sum()) - sum(len(fit.spline.c) for fit in fits)
        misfit = sum(float((self.weight[f.rows] * (self.y[f.rows] - f.state[:, 0]) ** 2).sum()) for f in fits)
        return float(np.sqrt(misfit / max(spare, 1)))

    def missed(self, fits: list[PieceFit], factor: float) -> Array:
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

    def lost(self, plan: Plan, fits: list[PieceFit], factor: float) -> Array:
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


def _at_sample(fits: list[PieceFit], row: int) -> float:
    for fit in fits:
        where = np.flatnonzero(fit.rows == row)
        if where.size:
            return float(fit.state[where[0], 0])
    return float("nan")


def _steps(most: float) -> list[int]:
    """Numbers of knot intervals to try: 1, 2, 3, then by the factor 1.3."""
    steps, m = [], 1.0
    while m <= max(most, 1.0):
        steps.append(round(m))
        m = max(m + 1, m * 1.3)
    return steps
