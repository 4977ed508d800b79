"""Two cameras' clocks from the sound that both recorded: where the two tracks resemble each other most.

The tracks are whitened before they are correlated (GCC-PHAT, Knapp and Carter 1976): a clap or mere room noise then
gives one sharp peak, whatever the microphones' tone. The lag is found for the whole recording first and then for
short windows along it, whose lags lie on a line: offset and rate, with standard errors from their scatter.
Sound needs 2.9 ms a metre (0.09 of a frame at 30 Hz): microphones should stand equally far from its source.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.camera import Array
from vidtrack.timing.clock import Clock

SAMPLED = 0.1
"""Of a sample: what a parabola through the correlation's peak may be off, the same in every window."""


class Timing(NamedTuple):
    """A camera's clock against another's, and how well it is known."""

    clock: Clock  # to be given to the second camera
    sd: Clock  # standard errors; NaN where the recordings do not tell
    n: int  # windows or events that agree
    of: int  # that were looked at


def timing_from_sound(
    a: ArrayLike, b: ArrayLike, rate_hz: float, *, start_a: float = 0.0, start_b: float = 0.0, window_s: float = 2.0
) -> Timing:
    """The clock of camera b that makes its sound agree with camera a's.

    a, b            (n,)  sound, any level or polarity, at one sampling rate; not necessarily the same length
    start_a, _b     s, each camera's time at its first sample
    Windows whose lag is off the line of the others by more than five times the usual amount do not count; where
    fewer than half agree, or the tracks have less than two windows in common, nothing is told (NaN).
    Raises ValueError for sound that is not (n,).
    """
    x, y = np.asarray(a, float), np.asarray(b, float)
    if x.ndim != 1 or y.ndim != 1:
        raise ValueError(f"sound must be (n,), not {x.shape} and {y.shape}")
    lag = _lag(x, y)
    whole = round(lag) if np.isfinite(lag) else 0  # y[i] sounds like x[i + whole]
    size = int(window_s * rate_hz)
    first, last = max(0, whole), min(x.size, y.size + whole)
    starts = np.arange(first, last - size + 1, size)
    nothing = Timing(Clock(), Clock(np.nan, np.nan), 0, len(starts))
    if len(starts) < 2:
        return nothing
    lags = np.array([_lag(x[i : i + size], y[i - whole : i - whole + size], reach=size // 4) for i in starts])
    later = (starts - whole + size / 2) / rate_hz  # s after b's first sample
    good = _agreeing(lags, (0.001 + 500e-6 * float(np.ptp(later))) * rate_hz)
    for _ in range(10):
        if good.sum() < max(2, len(lags) / 2):
            return nothing
        A = np.stack([np.ones(good.sum()), later[good]], -1)
        line, *_ = np.linalg.lstsq(A, lags[good], rcond=None)
        off = np.abs(lags - line[0] - line[1] * later)
        # half a sample is what the sampling itself may do
        again = off <= max(5 * 1.4826 * float(np.median(off[good])), 0.5)
        if (again == good).all():
            break
        good = again
    spread2 = max(float(np.sum(off[good] ** 2)) / max(int(good.sum()) - 2, 1), 1e-4)
    covariance = np.linalg.inv(A.T @ A) * spread2 / rate_hz**2
    offset = start_a - start_b + (whole + line[0]) / rate_hz
    return Timing(
        Clock(float(offset), float(line[1] / rate_hz * 1e6)),
        Clock(float(np.hypot(np.sqrt(covariance[0, 0]), SAMPLED / rate_hz)), float(np.sqrt(covariance[1, 1])) * 1e6),
        int(good.sum()),
        len(starts),
    )


def _agreeing(lags: Array, slack: float) -> NDArray[np.bool_]:
    """The largest number of lags, samples, that lie within `slack` of one of them."""
    near = np.abs(lags - lags[:, None]) <= slack
    return np.asarray(near[int(near.sum(1).argmax())])


def _lag(x: Array, y: Array, reach: int | None = None) -> float:
    """By how many samples y must be delayed to sound like x, to a fraction; NaN for silence."""
    if not (np.ptp(x) > 0 and np.ptp(y) > 0):
        return float("nan")
    n = 1 << int(np.ceil(np.log2(x.size + y.size)))
    cross = np.fft.rfft(x - x.mean(), n) * np.conj(np.fft.rfft(y - y.mean(), n))
    level = np.abs(cross)
    # whitened, but not where there is hardly any sound: rounding and hiss would speak as loudly
    peak = np.abs(np.fft.irfft(cross / (level + 0.01 * level.mean()), n))
    lags = np.fft.fftfreq(n, 1 / n).astype(int)
    if reach is not None:
        peak = np.where(np.abs(lags) <= reach, peak, 0)
    top = int(np.argmax(peak))
    left, middle, right = peak[top - 1], peak[top], peak[(top + 1) % n]
    bend = left - 2 * middle + right
    return float(lags[top] + (0.5 * (left - right) / bend if bend < 0 else 0.0))
