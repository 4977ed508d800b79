"""Two cameras' clocks from the sound that both recorded: where the two tracks resemble each other most.

The tracks are whitened before they are correlated (GCC-PHAT, Knapp and Carter 1976): a clap or mere room noise then
gives one sharp peak, whatever the microphones' tone. The lag is found for one stretch first, the loudest that has a
clear peak, and followed from there window by window; the windows' lags lie on a line: offset and rate, with standard
errors from their scatter. A window counts if its peak stands clear of the rest: silence between claps does no harm.
Sound needs 2.9 ms a metre (0.09 of a frame at 30 Hz): where the microphones were is not known here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.timing.agreement import NOT_ESTIMATED, Timing
from vidtrack.timing.clock import RATE_PRIOR_PPM, Clock

SAMPLED = 0.05
"""Of a sample: what a curve through the correlation's peak may be off, the same in every window."""

STRETCH_S, TRIES = 10.0, 8
"""Length of the stretch that is looked for in the whole of the other track, and how many such are tried."""

APART_S, ALONE = 0.01, 1.25
"""A peak is accepted that is so many times as high as any other further than this from it, s: that of a hum, which
sounds the same a period later, is not."""

TAPER = 0.05
"""Share of a stretch over which it is let in, and out."""

REACH_S = 300.0
"""How far apart two tracks may be; longer ones would take too much memory to search at once."""

CLEAR = 8.0
"""Times the correlation's rms that its peak must reach: that of mere noise reaches 7."""

DRIFT, JITTER_S = 1000e-6, 0.001
"""How far the lag may go from where it was found, s a second and s: clocks that differ by more are no clocks."""


def timing_from_sound(
    a: ArrayLike, b: ArrayLike, rate_hz: float, *, start_a: float = 0.0, start_b: float = 0.0, window_s: float = 2.0
) -> Timing:
    """The clock of camera b that makes its sound agree with camera a's; its offset is that at b's first sample.

    a, b            (n,)  sound, any level or polarity, at one sampling rate; not necessarily the same length
    start_a, _b     s, each camera's time at its first sample
    window_s        s; an eighth of the shorter track where that is less
    Windows whose lag is off the line of the others by more than five times the usual amount do not count; where
    fewer than half agree, there is no estimate (NaN). A single clap gives the offset, and leaves the rate at
    RATE_PRIOR_PPM. Raises ValueError for sound that is not (n,).
    """
    x, y = np.asarray(a), np.asarray(b)
    if x.ndim != 1 or y.ndim != 1:
        raise ValueError(f"sound must be (n,), not {x.shape} and {y.shape}")
    size = int(rate_hz * min(window_s, min(x.size, y.size) / rate_hz / 8))
    apart = (start_b - start_a) * rate_hz
    found = _anywhere(x, y, rate_hz, round(apart) if abs(apart) < REACH_S * rate_hz else 0) if size > 16 else None
    if found is None:
        return NOT_ESTIMATED
    lags, middles, of = _followed(x, y, found, size)
    if not lags.size:
        return NOT_ESTIMATED._replace(of=of)
    later = middles / rate_hz
    # the stretch by which the lag was found is the surest of all
    good = np.abs(lags - found.lag) <= JITTER_S * rate_hz + DRIFT * np.abs(middles - found.at)
    for _ in range(10):
        n = int(good.sum())
        if n < max(1, len(lags) / 2):
            return NOT_ESTIMATED._replace(of=of)
        A = np.stack([np.ones(n), later[good]], -1)
        # the rate near 0 unless the windows show it, in samples a second
        prior = np.diag([0.0, (0.5 / (RATE_PRIOR_PPM * 1e-6 * rate_hz)) ** 2])
        line = np.linalg.solve(A.T @ A + prior, A.T @ lags[good])
        off = np.abs(lags - line[0] - line[1] * later)
        # half a sample is what the sampling itself may do
        again = off <= max(5 * 1.4826 * float(np.median(off[good])), 0.5)
        if (again == good).all():
            break
        good = again
    spread2 = max(float(np.sum(off[good] ** 2)) / (n - 2) if n > 2 else 0.25, 1e-4)
    unit = np.array([1 / rate_hz, 1e6 / rate_hz])
    prior = np.diag([0.0, spread2 * (RATE_PRIOR_PPM * 1e-6 * rate_hz) ** -2])
    covariance = np.linalg.inv(A.T @ A + prior) * spread2 * unit * unit[:, None]
    covariance[0, 0] += (SAMPLED / rate_hz) ** 2
    clock = Clock(float(start_a - start_b + line[0] / rate_hz), float(line[1] * unit[1]))
    return Timing(clock, covariance, n, of)


class _Found(NamedTuple):
    lag: int  # y[i] sounds like x[i + lag]
    at: int  # sample of y about which that was found


def _anywhere(x: NDArray[np.floating], y: NDArray[np.floating], rate_hz: float, apart: int) -> _Found | None:
    """The lag, from the loudest stretches of y that x has a clear likeness of, `apart` samples from its place or so."""
    size = min(int(STRETCH_S * rate_hz), y.size)
    starts = np.arange(0, y.size - size + 1, size)
    loud = np.array([float(np.abs(y[i : i + size]).max()) for i in starts])
    for start in starts[np.argsort(-loud, kind="stable")][:TRIES]:
        reach = int(REACH_S * rate_hz)
        first = max(0, start + apart - reach)
        whole = x[first : max(0, start + apart + size + reach)]
        peak = _peak(whole, y[start : start + size], apart=int(APART_S * rate_hz))
        if peak.clear > CLEAR and peak.alone > ALONE:
            return _Found(round(peak.lag) + first - int(start), int(start) + size // 2)
    return None


def _followed(x: NDArray[np.floating], y: NDArray[np.floating], found: _Found, size: int) -> tuple[Array, Array, int]:
    """Lags (n,), samples, of the windows that have a clear one; their middles in y (n,); how many were looked at."""
    lags_at: list[tuple[float, float]] = []
    of = 0
    begin = max(0, found.at - size // 2)
    for starts in (range(begin, y.size - size + 1, size), range(begin - size, -1, -size)):
        lag = found.lag
        for i in starts:
            if not 0 <= i + lag <= x.size - size:
                continue
            of += 1
            peak = _peak(x[i + lag : i + lag + size], y[i : i + size], reach=size // 8)
            if peak.clear > CLEAR:
                lags_at.append((lag + peak.lag, i + size / 2))
                lag = round(lag + peak.lag)
    lags, middles = np.array(lags_at).reshape(-1, 2).T
    return lags, middles, of


class _Peak(NamedTuple):
    lag: float  # samples by which y must be delayed to sound like x; NaN for silence
    clear: float  # the peak over the correlation's rms
    alone: float  # and over the highest elsewhere, where that is wanted


def _peak(
    x: NDArray[np.floating], y: NDArray[np.floating], *, reach: int | None = None, apart: int | None = None
) -> _Peak:
    """Where the correlation peaks, to a fraction of a sample.

    reach   samples: only lags up to that are looked at
    apart   samples: another peak further off than that is another answer
    """
    if x.size < 3 or y.size < 3 or not (np.ptp(x) > 0 and np.ptp(y) > 0):
        return _Peak(float("nan"), 0.0, 0.0)
    n = 1 << int(np.ceil(np.log2(x.size + y.size)))
    cross = np.fft.rfft(_tapered(x), n) * np.conj(np.fft.rfft(_tapered(y), n))
    level = np.abs(cross)
    # whitened, but not where there is hardly any sound: rounding and hiss would count as much
    flat = cross / (level + 0.01 * level.mean())
    # less and less of it towards half the sampling rate: the peak is then a bell that is seen between samples too
    height = np.abs(np.fft.irfft(flat * (0.5 + 0.5 * np.cos(np.pi * np.arange(level.size) / level.size)), n))
    usual = float(np.sqrt(np.mean(height * height)))
    lags = np.arange(n)
    lags[x.size :] -= n
    some = height if reach is None else np.where(np.abs(lags) <= reach, height, 0)
    top = int(np.argmax(some))
    middle = height[top]
    left, right = (np.log(max(height[(top + k) % n] / middle, 1e-9)) for k in (-1, 1))
    fraction = float(np.clip(0.5 * (left - right) / (left + right), -1, 1)) if left + right < 0 else 0.0
    next_best = 0.0 if apart is None else float(np.where(np.abs(lags - lags[top]) > apart, height, 0).max())
    return _Peak(float(lags[top]) + fraction, float(middle) / usual, float(middle) / max(next_best, usual))


def _tapered(x: NDArray[np.floating]) -> NDArray[np.floating]:
    """Without its mean, and let in and out gently: a hum that is cut off would leak into every frequency."""
    ends = max(1, int(TAPER * x.size))
    rise = 0.5 - 0.5 * np.cos(np.pi * (np.arange(ends) + 0.5) / ends)
    out: NDArray[np.floating] = x - x.mean()
    out[:ends] *= rise
    out[-ends:] *= rise[::-1]
    return out
