"""Irregular waves and motions: spectra, transfer functions with coherence, and statistics of single waves.

Spectra are one-sided densities by Welch's method (scipy.signal): Hann windows that overlap by half. Bands and standard
errors: Bendat and Piersol, Random Data, 4th edition, chapters 8 and 9.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array


class Spectrum(NamedTuple):
    """A one-sided density S (n,), unit^2/Hz, at f (n,) Hz, with its degrees of freedom and 95 % band."""

    f: Array
    S: Array
    freedom: float
    low: Array
    high: Array


class SeaState(NamedTuple):
    """Hm0 = 4 sqrt(m0), as given; Tp = 1 / f at the largest density, Tz = sqrt(m0/m2), Te = m-1/m0, s."""

    Hm0: float
    Tp: float
    Tz: float
    Te: float


class Transfer(NamedTuple):
    """The response of y to x: H = Sxy / Sxx, complex, with coherence and standard errors.

    f          (n,) Hz
    H          (n,) complex, y's unit by x's; its angle is the lead of y
    coherence  (n,) squared, 0 to 1
    sd_ratio   (n,) standard error of |H| as a share of it, and of its angle, rad: Bendat and Piersol (9.90), with the
               degrees of freedom that the estimate leaves of the noise
    averages   independent segments; freedom: degrees of freedom of the standard errors, for Student's t
    """

    f: Array
    H: NDArray[np.complex128]
    coherence: Array
    sd_ratio: Array
    averages: float
    freedom: float


class SingleWaves(NamedTuple):
    """Waves by the upward crossings of the mean: height (n,), period (n,) s, and what is quoted of them."""

    height: Array
    period: Array
    H13: float
    Hmax: float
    Tz: float
    H110: float = float("nan")


def evenly(t: ArrayLike, x: ArrayLike, *, longest_gap: float = 3.0) -> tuple[float, Array]:
    """The longest stretch without a gap of more than `longest_gap` steps, on an even grid: (step in s, values (n,)).

    Shorter gaps are bridged by straight lines. Raises ValueError where fewer than 64 samples are left.
    """
    ts, xs = np.asarray(t, float), np.asarray(x, float)
    good = np.isfinite(ts) & np.isfinite(xs)
    ts, xs = ts[good], xs[good]
    if ts.size < 64:
        raise ValueError(f"{ts.size} measured samples; spectra need at least 64")
    step = float(np.median(np.diff(ts)))
    breaks = np.flatnonzero(np.diff(ts) > (longest_gap + 0.5) * step)
    edges = np.concatenate([[0], breaks + 1, [ts.size]])
    longest = int(np.argmax(np.diff(edges)))
    ts, xs = ts[edges[longest] : edges[longest + 1]], xs[edges[longest] : edges[longest + 1]]
    if ts.size < 64:
        raise ValueError(f"the longest stretch without gaps has {ts.size} samples; spectra need at least 64")
    grid = ts[0] + step * np.arange(int((ts[-1] - ts[0]) / step + 1e-6) + 1)
    return step, np.interp(grid, ts, xs)


def spectrum(step: float, x: ArrayLike, *, resolution: float | None = None) -> Spectrum:
    """The density of an even record (n,): step s; resolution Hz, default: the record in 16 half-overlapping parts."""
    from scipy.signal import welch
    from scipy.special import chdtri

    record = np.asarray(x, float)
    size = _segment(len(record), step, resolution)
    how: dict[str, Any] = {"window": "hann", "nperseg": size, "detrend": "linear"}
    f, S = welch(record, 1 / step, **how)
    freedom = 2 * _averages(len(record), size)
    return Spectrum(f, S, freedom, S * freedom / chdtri(freedom, 0.025), S * freedom / chdtri(freedom, 0.975))


def sea_state(of: Spectrum, *, f_min: float = 0.0, f_max: float = np.inf) -> SeaState:
    """Significant height and periods by the moments of a spectrum between two frequencies, Hz."""
    use = (of.f > max(f_min, 0.0)) & (of.f <= f_max)
    f, S = of.f[use], of.S[use]
    moments = {n: float(np.trapezoid(S * f**n, f)) for n in (-1, 0, 1, 2)}
    peak = int(np.argmax(S))
    top = float(f[peak])
    if 0 < peak < len(f) - 1 and np.all(S[peak - 1 : peak + 2] > 0):
        below, at, above = np.log(S[peak - 1 : peak + 2])
        bend = below - 2 * at + above
        top += float(0.5 * (below - above) / bend * (f[1] - f[0])) if bend < 0 else 0.0
    return SeaState(4 * np.sqrt(moments[0]), 1 / top, float(np.sqrt(moments[0] / moments[2])), moments[-1] / moments[0])


def transfer(step: float, x: ArrayLike, y: ArrayLike, *, resolution: float | None = None) -> Transfer:
    """The response of y (n,) to x (n,), even records of the same instants, by the cross spectrum.

    A response that follows by a part of a segment is compared with the part of the wave that made it, else its ratio
    and phase are biased (Bendat and Piersol, 9.3): the records are shifted by the lag of their strongest correlation.
    """
    from scipy.signal import csd, welch

    cause, answer = np.asarray(x, float), np.asarray(y, float)
    if cause.shape != answer.shape:
        raise ValueError("x and y must be samples of the same instants")
    size = _segment(len(cause), step, resolution)
    lag = _lag(cause, answer, min(size // 2, len(cause) - size))
    cause, answer = (cause[: len(cause) - lag], answer[lag:]) if lag >= 0 else (cause[-lag:], answer[:lag])
    how: dict[str, Any] = {"window": "hann", "nperseg": size, "detrend": "linear"}
    f, Sxy = csd(cause, answer, 1 / step, **how)
    _, Sxx = welch(cause, 1 / step, **how)
    _, Syy = welch(answer, 1 / step, **how)
    averages = _averages(len(cause), size)
    freedom = max(1.0, 2 * (averages - 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        H = Sxy / Sxx * np.exp(-2j * np.pi * f * lag * step)
        coherence = np.abs(Sxy) ** 2 / (Sxx * Syy)
        sd = np.sqrt(np.clip(1 - coherence, 0, 1) / (freedom * coherence))
    return Transfer(f, H, coherence, sd, averages, freedom)


def _lag(cause: Array, answer: Array, most: int) -> int:
    """Samples by which the answer follows: where the envelope of the correlation is highest, within `most` of 0."""
    n = len(cause)
    size = 1 << (2 * n - 1).bit_length()
    whole = np.fft.fft(answer - answer.mean(), size) * np.conj(np.fft.fft(cause - cause.mean(), size))
    whole[size // 2 + 1 :] = 0  # of the analytic signal, whose size is the envelope
    envelope = np.abs(np.fft.ifft(whole))
    lags = np.arange(-most, most + 1)
    return int(lags[np.argmax(envelope[lags])])


def single_waves(step: float, x: ArrayLike) -> SingleWaves:
    """Heights and periods between upward crossings of the mean of an even record (n,)."""
    record = np.asarray(x, float)
    record = record - record.mean()
    up = np.flatnonzero((record[:-1] < 0) & (record[1:] >= 0))
    if up.size < 2:
        nothing = np.empty(0)
        return SingleWaves(nothing, nothing, float("nan"), float("nan"), float("nan"))
    at = (up + record[up] / (record[up] - record[up + 1])) * step
    period = np.diff(at)
    starts = up[:-1] + 1
    ends = up[1:] + 1
    height = np.array([record[a:b].max() - record[a:b].min() for a, b in zip(starts, ends, strict=True)])
    ordered = np.sort(height)[::-1]
    H13, H110 = (float(ordered[: max(1, round(height.size / part))].mean()) for part in (3, 10))
    return SingleWaves(height, period, H13, float(height.max()), float(period.mean()), H110)


def _segment(n: int, step: float, resolution: float | None) -> int:
    size = round(1 / (resolution * step)) if resolution else int(2 * n / 17)
    return int(np.clip(size, 16, n))


def _averages(n: int, size: int) -> float:
    """Independent averages of half-overlapping Hann segments (Welch 1967): the overlap's correlation is 1/36."""
    hop = size - size // 2
    count = 1 + (n - size) // hop
    return float(count / (1 + 2 * (1 / 36) * (count - 1) / count))
