"""Regular waves and motions: period, amplitude and phase of the harmonics, and the response to a wave.

A record over a whole number of periods is fitted by least squares with

    x(t) = c + d (t - tm) + sum over h of A_h cos(2 pi h f (t - t0) - phi_h)

f common to all channels of a run. Phases count from t0; the phase of a response is that by which it follows the wave (a
lag), so that response = a cos(omega t - phase) where the wave has its crest at t = 0. Missing samples are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.analysis.interval import Estimate, parameter_covariance, t_factor
from vidtrack.arrays import Array

FEW_SAMPLES_A_PERIOD = 100
"""Validation data of the US Department of Energy ask for at least so many samples in a wave period."""


NOT_ZERO = 2.4477
"""Standard errors of a vector of two parts beyond which it is not zero, at 95 %: root of chi squared, 2 degrees."""


class Harmonics(NamedTuple):
    """What `fit_harmonics` returns.

    f              Hz, fundamental frequency
    mean, drift    as given, and as given per second
    coefficients   (n_harmonics,) complex A exp(-i phi): amplitude as given, phase in radians after t0
    covariance     (2 n, 2 n) of their real and imaginary parts, real and imaginary in turn
    amplitude      (n_harmonics,) Estimates; phase_deg likewise
    periods        whole periods that were used; samples_a_period
    steadiness     standard deviation over the periods of the fundamental's amplitude, as a share of it
    rms            of the residual, as given
    """

    f: float
    mean: Estimate
    drift: Estimate
    coefficients: NDArray[np.complex128]
    covariance: Array
    amplitude: list[Estimate]
    phase_deg: list[Estimate]
    periods: int
    samples_a_period: float
    steadiness: float
    rms: float


class Response(NamedTuple):
    """Amplitude ratio and phase lag of one harmonic of a response to the wave's fundamental.

    ratio       response's amplitude over the wave's, units of both as given
    phase_deg   by which the response follows the wave, -180 to 180
    """

    ratio: Estimate
    phase_deg: Estimate


def fundamental_frequency(t: ArrayLike, x: ArrayLike, expected: float | None = None) -> Estimate:
    """The frequency, Hz, of a regular record (n,): that with the least residual of two harmonics with mean and drift.

    expected   Hz, where it is known to some 10 %; else the largest line of the spectrum is refined
    """
    from scipy.optimize import minimize_scalar

    ts, xs = _measured(t, x)
    length = ts[-1] - ts[0]
    if expected is None:
        grid = np.linspace(ts[0], ts[-1], 4 * len(ts))
        power = np.abs(np.fft.rfft((np.interp(grid, ts, xs) - xs.mean()) * np.hanning(grid.size), 4 * grid.size))
        frequency = np.fft.rfftfreq(4 * grid.size, grid[1] - grid[0])
        power[frequency < 1.5 / length] = 0.0
        expected = float(frequency[int(np.argmax(power))])
    reach = 0.7 / length

    def left(f: float) -> float:
        J = _design(ts, f, ts[0], 2)
        return float(np.sum((xs - J @ np.linalg.lstsq(J, xs, rcond=None)[0]) ** 2))

    trials = np.linspace(max(expected - 2 * reach, 0.2 / length), expected + 2 * reach, 25)
    best = int(np.argmin([left(f) for f in trials]))
    answer = minimize_scalar(
        left, bounds=(trials[max(0, best - 1)], trials[min(24, best + 1)]), method="bounded", options={"xatol": 1e-9}
    )
    f = float(answer.x)
    J = _design(ts, f, ts.mean(), 2)
    solution, *_ = np.linalg.lstsq(J, xs, rcond=None)
    turning = 2 * np.pi * (ts - ts.mean())
    by_f = sum(h * turning * (solution[2 * h + 1] * J[:, 2 * h] - solution[2 * h] * J[:, 2 * h + 1]) for h in (1, 2))
    covariance = parameter_covariance(np.column_stack([J, by_f]), xs - J @ solution)
    return Estimate(f, t_factor(len(ts) - 7) * float(np.sqrt(covariance[-1, -1])))


def fit_harmonics(t: ArrayLike, x: ArrayLike, f: float, *, n_harmonics: int = 3, t0: float = 0.0) -> Harmonics:
    """Fit mean, drift and harmonics over the largest whole number of periods at the record's end.

    t    (n,)  s, rising; x (n,) as given, NaN where missing; f Hz; t0 s, where phases count from
    Raises ValueError where the record is shorter than two periods.
    """
    ts, xs = _measured(t, x)
    step = float(np.median(np.diff(ts)))
    periods = int((ts[-1] - ts[0] + step) * f * (1 + 1e-9))
    if periods < 2:
        held = (ts[-1] - ts[0]) * f
        raise ValueError(f"the record has {held:.1f} periods of {1 / f:.4g} s; at least 2 are needed")
    # the last sample of a whole period is the first of the next
    use = ts > ts[-1] + step / 2 - periods / f
    ts, xs = ts[use], xs[use]
    J = _design(ts, f, t0, n_harmonics)
    solution, *_ = np.linalg.lstsq(J, xs, rcond=None)
    residual = xs - J @ solution
    covariance = parameter_covariance(J, residual)
    factor = t_factor(len(ts) - J.shape[1])
    coefficients = solution[2::2] - 1j * solution[3::2]
    amplitude: list[Estimate] = []
    phase: list[Estimate] = []
    for h, c in enumerate(coefficients):
        at = slice(2 + 2 * h, 4 + 2 * h)
        along, across = _polar_sd(solution[at], covariance[at, at])
        lag = Estimate(float(-np.degrees(np.angle(c))), float(np.degrees(factor * across)))
        size, lag = beyond_zero(Estimate(float(abs(c)), factor * along), lag)
        amplitude.append(size)
        phase.append(lag)
    own = [abs(_one_period(ts, xs, f, t0, k)) for k in range(periods)]
    return Harmonics(
        f=f,
        mean=Estimate(float(solution[0]), float(factor * np.sqrt(covariance[0, 0]))),
        drift=Estimate(float(solution[1]), float(factor * np.sqrt(covariance[1, 1]))),
        coefficients=coefficients,
        covariance=covariance[2:, 2:],
        amplitude=amplitude,
        phase_deg=phase,
        periods=periods,
        samples_a_period=float(1 / (f * step)),
        steadiness=float(np.nanstd(own, ddof=1) / abs(coefficients[0])) if coefficients[0] else float("nan"),
        rms=float(np.sqrt(np.mean(residual**2))),
    )


def beyond_zero(amplitude: Estimate, phase_deg: Estimate) -> tuple[Estimate, Estimate]:
    """Amplitude and phase with intervals that hold also where the amplitude may be 0: the phase is then open.

    The amplitude of noise alone is never 0, and lies beyond 1.96 standard errors in 15 of 100 records; so an amplitude
    that two parts of noise explain (see `NOT_ZERO`) has an interval that reaches 0.
    """
    across = amplitude.value * np.radians(phase_deg.half_width)
    reach = NOT_ZERO / 1.96 * float(np.fmax(amplitude.half_width, across))
    if not amplitude.value < reach:
        return amplitude, phase_deg
    open_phase = phase_deg._replace(half_width=180.0) if np.isfinite(phase_deg.value) else phase_deg
    return amplitude._replace(half_width=reach), open_phase


def response(wave: Harmonics, motion: Harmonics, *, harmonic: int = 1) -> Response:
    """The motion's harmonic against the wave's fundamental; both fitted with the same f and t0.

    For harmonic h the phase is phi_motion,h - h phi_wave,1: that of the motion where the wave's crest passes at t = 0.
    Both records' errors are independent and go into the half widths.
    """
    w, m = wave.coefficients[0], motion.coefficients[harmonic - 1]
    i = 2 * (harmonic - 1)
    wave_along, wave_across = _polar_sd(np.array([w.real, -w.imag]), wave.covariance[:2, :2])
    own = motion.covariance[i : i + 2, i : i + 2]
    along, across = _polar_sd(np.array([m.real, -m.imag]), own)
    ratio = abs(m) / abs(w)
    relative = np.hypot(along / abs(m), wave_along / abs(w)) if abs(m) > 0 else np.inf
    phase = -np.angle(m) + harmonic * np.angle(w)
    turned = float(np.degrees(np.angle(np.exp(1j * phase))))
    width = np.hypot(across, harmonic * wave_across)
    return Response(
        Estimate(float(ratio), float(1.96 * relative * ratio)), Estimate(turned, float(np.degrees(1.96 * width)))
    )


def phase_average(
    t: ArrayLike, x: ArrayLike, f: float, *, t0: float = 0.0, bins: int = 50
) -> tuple[Array, Array, Array]:
    """The mean cycle: phase (bins,) in periods from t0, mean (bins,), standard deviation over the cycles (bins,).

    The phase is the mean one of a bin's samples, which may all lie at its edge where they keep step with the wave.
    """
    ts, xs = _measured(t, x)
    own = ((ts - t0) * f) % 1.0
    index = np.minimum((own * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins).astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        phase = np.bincount(index, own, bins) / count
        mean = np.bincount(index, xs, bins) / count
        variance = np.bincount(index, (xs - mean[index]) ** 2, bins) / (count - 1)
    phase = np.where(count > 0, phase, (np.arange(bins) + 0.5) / bins)
    return phase, mean, np.sqrt(np.where(count > 1, variance, np.nan))


def _measured(t: ArrayLike, x: ArrayLike) -> tuple[Array, Array]:
    ts, xs = np.asarray(t, float), np.asarray(x, float)
    good = np.isfinite(ts) & np.isfinite(xs)
    if good.sum() < 8:
        raise ValueError("fewer than 8 measured samples")
    return ts[good], xs[good]


def _design(t: Array, f: float, t0: float, n_harmonics: int) -> Array:
    columns = [np.ones_like(t), t - t.mean()]
    for h in range(1, n_harmonics + 1):
        angle = 2 * np.pi * h * f * (t - t0)
        columns += [np.cos(angle), np.sin(angle)]
    return np.column_stack(columns)


def _polar_sd(parts: Array, covariance: Array) -> tuple[float, float]:
    """Standard deviations of amplitude and of phase, rad, of a cosine and sine part with their covariance (2, 2)."""
    size = np.hypot(*parts)
    if size == 0:
        return float(np.sqrt(covariance[0, 0])), float("inf")
    along = parts / size
    across = np.array([-along[1], along[0]])
    return float(np.sqrt(along @ covariance @ along)), float(np.sqrt(across @ covariance @ across) / size)


def _one_period(t: Array, x: Array, f: float, t0: float, k: int) -> complex:
    """The fundamental of the k-th period alone; NaN where too little of it was measured."""
    own = (t - t[0]) * f
    use = (own >= k - 1e-9) & (own < k + 1)
    if use.sum() < 6:
        return complex("nan")
    J = _design(t[use], f, t0, 1)[:, [0, 2, 3]]
    solution, *_ = np.linalg.lstsq(J, x[use], rcond=None)
    return complex(solution[1], -solution[2])
