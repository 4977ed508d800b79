"""How much later one record shows the same motion than another, to a small part of a sample.

Two records of one motion, sampled at different times and rates, are laid over each other by cross-correlation:
first on a common grid, every lag at once (masked, so that gaps count for nothing), then between the samples by
least squares on

    y(t) = bias + gain x(t - lag)

where x and its slope between its samples come from the spline of `smoothing`. The residuals of such records are
not independent (vibration, quantised sensors), so the confidence interval takes their correlation over time
into account (Newey & West 1987).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.motion.smoothing import Smooth, between, smooth

LEAST_OVERLAP = 0.5
"""Share of the shorter record that a lag must leave in common to be considered."""
AS_GOOD = 2.0
"""Lags whose unexplained variance is within this factor of the least are equally likely; the shortest is taken."""
TURNED, TOO_LITTLE = 10.0, 1e-4
"""Half a period later a steady motion fits turned round as well, and errors of a share of the motion decide. Records
run opposite only where that leaves so many times less unexplained than any lag at which they run alike, and where these
leave more than this share of the variance (1 % of the amplitude)."""
CORNER = 4
"""Samples of the largest residuals that do not count where lags are compared: no spline follows the corner of a record
at which a motion begins, and lags that leave the beginning out would seem the better ones."""
FEWEST = 8
"""Common samples below which no lag is estimated."""


class Lag(NamedTuple):
    """How much later y shows the motion than x; s.

    sd, low, high    standard deviation, and the ends of the 95 % confidence interval
    correlation      at that lag, signed
    others           lags that explain the records about as well (a steady oscillation repeats itself)
    n                samples that were compared
    """

    lag_s: float
    sd: float
    low: float
    high: float
    correlation: float
    others: tuple[float, ...]
    n: int


class Agreement(NamedTuple):
    """How y agrees with x sample by sample: y = gain x + bias; difference = y - x. All in the unit of y.

    gain, bias       least squares, with standard deviations gain_sd and bias_sd
    rms, max_abs     of the difference; mean_difference and sd_difference of it (Bland & Altman 1986)
    rms_fit          of what is left after gain and bias
    correlation      Pearson's
    """

    gain: float
    bias: float
    gain_sd: float
    bias_sd: float
    rms: float
    max_abs: float
    mean_difference: float
    sd_difference: float
    rms_fit: float
    correlation: float
    n: int


def find_lag(tx: ArrayLike, x: ArrayLike, ty: ArrayLike, y: ArrayLike, *, longest: float | None = None) -> Lag:
    """The lag of record y (m,) at times ty (m,) behind record x (n,) at tx (n,), s; NaN marks missing samples.

    longest   s, the greatest lag considered; default: what leaves half of the shorter record in common
    All NaN where the records hold fewer than eight common samples, or one of them does not move.
    Raises ValueError when times do not rise.
    """
    start, times = np.asarray(tx, float), np.asarray(ty, float)
    if len(start) < FEWEST or len(times) < FEWEST or not (_moves(x) and _moves(y)):
        return Lag(np.nan, np.nan, np.nan, np.nan, np.nan, (), 0)
    smooth_x, smooth_y = smooth(start, x), smooth(times, y)
    values: Array = np.where(smooth_y.outlier, np.nan, np.asarray(y, float))
    shorter = min(
        np.isfinite(values).sum(), np.isfinite(smooth_x.state[:, 0]).sum() * _interval(start) / _interval(times)
    )
    least = max(FEWEST, int(LEAST_OVERLAP * shorter))
    lags = _coarse(start, smooth_x, times, smooth_y, longest)
    tried = (_refined(smooth_x, times, values, lag, least) for lag in lags)
    found = [f for f in tried if f is not None and (longest is None or abs(f.lag) <= longest + 1e-9)]
    if not found:
        return Lag(np.nan, np.nan, np.nan, np.nan, np.nan, (), 0)
    closest = min(found, key=lambda f: f.steady)
    alike = min((f for f in found if f.gain > 0), key=lambda f: f.steady, default=closest)
    if closest.gain < 0 and alike.steady <= max(TURNED * closest.steady, TOO_LITTLE):
        closest = alike
    equal = closest.steady * max(AS_GOOD, 1 + 10 / np.sqrt(closest.good.sum()))  # few samples distinguish little
    # Of equals, one that needs no change of sign, then the shortest.
    good = sorted((f for f in found if f.steady <= equal), key=lambda f: (f.gain < 0, abs(f.lag)))
    best = good[0]
    noise = smooth_y.noise_sd**2 + (best.gain * smooth_x.noise_sd) ** 2 * _interval(start) / _interval(times)
    variance = max(
        float(long_run_covariance(best.J, best.rest, times[best.good])[0, 0]),
        noise * float(np.linalg.pinv(best.J.T @ best.J)[0, 0]),  # what white noise of both records alone would do
    )
    lag, sd = best.lag, float(np.sqrt(variance))
    correlation = float(np.sign(best.gain) * np.sqrt(max(1 - best.unexplained, 0.0)))
    others = {round(f.lag, 4) for f in good[1:] if abs(f.lag - lag) > _interval(times) / 2}  # else it is the same one
    return Lag(
        lag, sd, lag - 1.96 * sd, lag + 1.96 * sd, correlation, tuple(sorted(others, key=abs)), int(best.good.sum())
    )


def _moves(values: ArrayLike) -> bool:
    """Whether a record's values differ by more than rounding."""
    v: Array = np.asarray(values, float)
    v = v[np.isfinite(v)]
    return bool(len(v)) and float(np.ptp(v)) > 1e-12 * float(np.abs(v).max())


def _interval(t: Array) -> float:
    return float(np.median(np.diff(t)))


class _Refined(NamedTuple):
    lag: float
    gain: float
    unexplained: float  # share of y's variance
    steady: float  # the same without the largest few residuals
    J: Array
    rest: Array
    good: NDArray[np.bool_]


def _refined(x: Smooth, t: Array, y: Array, lag: float, least: int) -> _Refined | None:
    """The least-squares lag from a start; None where fewer than `least` samples are left to compare."""
    for _ in range(30):
        J, r, good, gain = _linearised(x, t, y, lag)
        if len(r) < least:
            return None
        step = float(np.linalg.lstsq(J, r, rcond=None)[0][0])
        lag += step
        if abs(step) < 1e-9:
            break
    J, r, good, gain = _linearised(x, t, y, lag)
    if len(r) < least:
        return None
    scale = max(float(y[good].var()), 1e-300)
    steady = r[np.argsort(np.abs(r))[: len(r) - min(CORNER, len(r) // FEWEST)]]
    return _Refined(lag, gain, float(r.var()) / scale, float(steady.var()) / scale, J, r, good)


def _linearised(x: Smooth, t: Array, y: Array, lag: float) -> tuple[Array, Array, NDArray[np.bool_], float]:
    """Derivatives of gain x(t - lag) + bias by lag, gain, bias (k, 3); y less that fit (k,); which samples; gain."""
    model, slope = between(x, t - lag), between(x, t - lag, 1)
    good: NDArray[np.bool_] = np.isfinite(model) & np.isfinite(y)
    line = np.stack([model[good], np.ones(int(good.sum()))], -1)
    fit = np.linalg.lstsq(line, y[good], rcond=None)[0]
    return np.column_stack([-fit[0] * slope[good], line]), y[good] - line @ fit, good, float(fit[0])


def long_run_covariance(J: ArrayLike, r: ArrayLike, t: ArrayLike) -> Array:
    """Covariance (k, k) of a least-squares fit whose residuals r (n,) are correlated over time t (n,).

    (J'J)^-1 S (J'J)^-1 with S the sum of the scores' autocovariances, under Bartlett's triangle (Newey & West 1987),
    over the lag 4 (n/100)^(2/9) samples or until the residuals' correlation has died away, whichever is longer.
    """
    design: Array = np.asarray(J, float)
    rest: Array = np.asarray(r, float)
    n, k = design.shape
    order = np.argsort(np.asarray(t, float), kind="stable")
    scores = design[order] * rest[order][:, None]
    reach = int(np.clip(max(4 * (n / 100) ** (2 / 9), 2 * _memory(rest[order])), 1, n // 4))
    S = scores.T @ scores
    for lag in range(1, reach + 1):
        part = scores[lag:].T @ scores[:-lag]
        S += (1 - lag / (reach + 1)) * (part + part.T)
    inverse = np.linalg.pinv(design.T @ design)
    # The triangle and the fit itself both take a little of the variance away.
    answer: Array = inverse @ S @ inverse * n / max(n - k, 1)
    plain = inverse * (rest @ rest) / max(n - k, 1)
    # Anticorrelated residuals may promise more than so few samples can prove.
    return answer if np.trace(answer) > 0.25 * np.trace(plain) else plain


def _memory(r: Array) -> int:
    """Samples after which the residuals' autocorrelation has sunk below 0.2."""
    n = len(r)
    spectrum = np.fft.rfft(r - r.mean(), 2 * n)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[: n // 4 + 1]
    if not correlation[0] > 0:
        return 0
    below = np.flatnonzero(correlation / correlation[0] < 0.2)
    return int(below[0]) if len(below) else n // 4


def _coarse(tx: Array, x: Smooth, ty: Array, y: Smooth, longest: float | None) -> list[float]:
    """Lags on a grid at which the records run alike or opposite, the likeliest first; empty where there is none."""
    if not (x.splines and y.splines):
        return []
    step = min(_interval(tx), _interval(ty))
    gx = np.arange(x.splines[0][0], x.splines[-1][1] + step / 2, step)
    gy = np.arange(y.splines[0][0], y.splines[-1][1] + step / 2, step)
    sx, sy = between(x, gx), between(y, gy)
    correlation, n, shift = masked_correlation(sx, sy)
    lags = gy[0] - gx[0] + shift * step
    least = LEAST_OVERLAP * min(np.isfinite(sx).sum(), np.isfinite(sy).sum())
    usable = (n >= max(FEWEST, least)) & np.isfinite(correlation)
    if longest is not None:
        usable &= np.abs(lags) <= longest + step
    strength = np.where(usable, np.abs(correlation), 0.0)
    inner = strength[1:-1]
    peaks = 1 + np.flatnonzero((inner >= strength[:-2]) & (inner > strength[2:]) & (inner > 0))
    if not len(peaks) and usable.any():
        peaks = np.array([int(np.argmax(strength))])
    order = peaks[np.argsort(-strength[peaks], kind="stable")]
    return [float(lag) for lag in lags[order[:16]]]


def masked_correlation(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array, NDArray[np.intp]]:
    """Pearson's correlation of y[i + k] with x[i] for every shift k, over the samples that both have.

    x (n,), y (m,) on one grid, NaN where missing. Returns correlation, number of pairs and k, each (n + m - 1,);
    NaN where fewer than two pairs meet or one record does not vary (Padfield 2012, by Fourier transform).
    """
    a: Array = np.asarray(x, float)
    b: Array = np.asarray(y, float)
    ma, mb = np.isfinite(a), np.isfinite(b)
    a, b = np.where(ma, a - np.mean(a[ma]), 0.0), np.where(mb, b - np.mean(b[mb]), 0.0)
    size = len(a) + len(b) - 1

    def sums(u: Array, v: Array) -> Array:
        product = np.fft.rfft(v, size) * np.conj(np.fft.rfft(u, size))
        return np.roll(np.fft.irfft(product, size), len(u) - 1)

    fa, fb = ma.astype(float), mb.astype(float)
    n = np.round(sums(fa, fb))
    with np.errstate(divide="ignore", invalid="ignore"):
        sa, sb = sums(a, fb), sums(fa, b)
        va, vb = sums(a * a, fb) - sa**2 / n, sums(fa, b * b) - sb**2 / n
        r = (sums(a, b) - sa * sb / n) / np.sqrt(va * vb)
    floor = 1e-9 * size
    r = np.where((n >= 2) & (va > floor * (a * a).mean()) & (vb > floor * (b * b).mean()), np.clip(r, -1, 1), np.nan)
    return r, n, np.arange(size) - (len(a) - 1)


def agreement(x: ArrayLike, y: ArrayLike) -> Agreement:
    """How record y (n,) agrees with x (n,) at the same times; pairs with NaN are left out; fewer than 3: NaN."""
    a: Array = np.asarray(x, float)
    b: Array = np.asarray(y, float)
    good = np.isfinite(a) & np.isfinite(b)
    a, b = a[good], b[good]
    n = len(a)
    if n < 3 or np.ptp(a) == 0:
        nan = float("nan")
        return Agreement(nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, n)
    J = np.stack([a, np.ones(n)], -1)
    c = np.linalg.lstsq(J, b, rcond=None)[0]
    rest = b - J @ c
    sd = np.sqrt(np.diag(long_run_covariance(J, rest, np.arange(n))))
    d = b - a
    r = float(np.corrcoef(a, b)[0, 1]) if np.ptp(b) > 0 else float("nan")
    return Agreement(
        float(c[0]),
        float(c[1]),
        float(sd[0]),
        float(sd[1]),
        float(np.sqrt((d**2).mean())),
        float(np.abs(d).max()),
        float(d.mean()),
        float(d.std(ddof=1)),
        float(np.sqrt((rest**2).mean())),
        r,
        n,
    )
