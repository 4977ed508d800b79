"""Estimates with their 95 % intervals, also where residuals are correlated from sample to sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array

LEAST_LAG = 4
"""Lags over which residuals may be correlated, at least."""

FIXED_B = (1.5150, 0.2122, -0.2716)
"""Kiefer and Vogelsang (2005, Econometric Theory 21:1130), table 1, Bartlett weights, 97.5 %: the critical value over
1.96 as a polynomial of the share of the record."""


class Estimate(NamedTuple):
    """A number and the half width of its 95 % interval."""

    value: float
    half_width: float


def parameter_covariance(J: Array, residual: Array) -> Array:
    """Covariance (k, k) of the parameters of a least-squares fit.

    J          (n, k)  derivatives of the residual by the parameters
    residual   (n,)    in time's order
    The white-noise covariance, and that of Newey and West (1987) with Bartlett weights, which holds where residuals
    are correlated over lags up to 4 (n / 100)^(2/9) and at least twice the lag where their correlation first vanishes;
    for each parameter the larger variance is taken. Both are scaled by n / (n - k); the second also by what its own
    scatter widens the interval, by the share of the record over which it reaches (Kiefer and Vogelsang 2005).
    """
    n, k = J.shape
    inverse = np.linalg.pinv(J.T @ J)
    freedom = max(1, n - k)
    white = inverse * float(residual @ residual) / freedom
    scores = J * residual[:, None]
    reach = min(n - 1, max(LEAST_LAG, int(4 * (n / 100) ** (2 / 9)), 2 * _first_zero(residual)))
    middle = scores.T @ scores
    for lag in range(1, reach + 1):
        product = scores[lag:].T @ scores[:-lag]
        middle += (1 - lag / (reach + 1)) * (product + product.T)
    robust = inverse @ middle @ inverse * n / freedom * own_scatter(reach / n) ** 2
    ratio = np.sqrt(np.maximum(1.0, np.diag(robust) / np.maximum(np.diag(white), 1e-300)))
    covariance: Array = white * np.outer(ratio, ratio)
    return covariance


def own_scatter(share: float) -> float:
    """By what an interval is wider for the scatter of its own variance, by the share of the record it is made over."""
    return 1 + FIXED_B[0] * share + FIXED_B[1] * share**2 + FIXED_B[2] * share**3


def t_factor(freedom: float) -> float:
    """Half width of a 95 % interval in standard errors, by Student's t."""
    from scipy.special import stdtrit

    return float(stdtrit(max(1.0, freedom), 0.975))


def _first_zero(residual: Array) -> int:
    """The lag at which the residual's correlation first vanishes, at most a tenth of the record."""
    n = len(residual)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(residual - residual.mean(), size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[: max(2, n // 10)]
    below = np.flatnonzero(correlation <= 0)
    return int(below[0]) if below.size else len(correlation)
