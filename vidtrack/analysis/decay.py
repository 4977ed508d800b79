"""Free decay: natural period and damping of a motion that was displaced and released.

The motion is fitted by the equation

    x'' + 2 zeta wn x' + b |x'| x' + wn^2 (x - c) = 0

whose solution is integrated through the samples, so that no filter and no choice of peaks bends the answer. The
classical decrement of successive half cycles stands beside it as a check: with amplitude a,

    ln(a_k / a_k+1) = alpha + (4/3) b a,    alpha = pi zeta / sqrt(1 - zeta^2)

(linear and quadratic damping, "p and q") to first order; the second order, which biases q by some percent where b a is
0.1, is in `_second_order`.
Sources: ITTC 7.5-02-07-04.5; the quadratic term's loss over a half cycle is the integral of b |x'|^3.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.analysis.interval import Estimate, parameter_covariance, t_factor
from vidtrack.arrays import Array, Bools

STEPS_A_PERIOD = 120
"""Steps of the integration in a natural period: error of the amplitude below 1e-6 of it a cycle; |x'| x' has a kink."""

HOLD_SAMPLES = 5
"""A displaced hold is recognised by at least so many samples at rest before the release."""

LEAST_AMPLITUDE = 0.02
"""Half cycles with less than this share of the first amplitude are not used: drift and noise rule there."""


DECREMENT_PASSES = 4
"""The second order of the decrement is computed from the first: the third pass changes q by less than 1e-5 of it."""


class Extremes(NamedTuple):
    """The half cycles of a decay.

    time        (n,) s, of the middle of each half cycle
    amplitude   (n,) half the distance between two successive extremes
    decrement   (n - 1,) ln(a_k / a_k+1) of successive half cycles
    """

    time: Array
    amplitude: Array
    decrement: Array


class Decay(NamedTuple):
    """What is estimated from a free decay.

    Td, fn, zeta, b   damped period (s), undamped natural frequency (Hz), linear damping ratio, quadratic damping
                      (1/length)
    rest              position of rest, as given
    release           s, when the motion was released; NaN where the record begins within the motion
    used              (n,) samples that were fitted
    fitted            (n,) the fitted motion; NaN where not used
    cycles            full cycles that were fitted
    rms               of the residual, as given
    p, q              linear damping ratio and quadratic coefficient by the decrement of half cycles
    extremes          the half cycles behind p and q
    """

    Td: Estimate
    fn: Estimate
    zeta: Estimate
    b: Estimate
    rest: Estimate
    release: float
    used: Bools
    fitted: Array
    cycles: float
    rms: float
    p: Estimate
    q: Estimate
    extremes: Extremes


def free_decay(
    t: ArrayLike, x: ArrayLike, *, drop_half_cycles: int = 2, quadratic: bool = True, end: float | None = None
) -> Decay:
    """Estimate natural period and damping from the record of one degree of freedom.

    t   (n,)  s, rising
    x   (n,)  any unit; NaN where the motion was not measured
    drop_half_cycles   half cycles after the release that are left out (transients of the release)
    quadratic          whether b is estimated; else it is 0
    end                s, last time used; default: until the amplitude is below LEAST_AMPLITUDE of the first
    Raises ValueError where fewer than three half cycles are left: the text says why.
    """
    time, value = np.asarray(t, float), np.asarray(x, float)
    if time.ndim != 1 or time.shape != value.shape:
        raise ValueError("t and x must be (n,) each")
    measured = np.isfinite(time) & np.isfinite(value)
    if measured.sum() < 20:
        raise ValueError("fewer than 20 measured samples")
    release, begin = _release(time[measured], value[measured])
    rest = float(np.median(value[measured & (time > time[measured][-1] - 0.25 * np.ptp(time[measured]))]))
    at, peaks = _extremes(time[measured], value[measured], begin, rest)
    if len(at) < drop_half_cycles + 4:
        seen = max(0, len(at) - 1)
        raise ValueError(f"only {seen} half cycles after the release; at least {drop_half_cycles + 3} are needed")
    at, peaks = at[drop_half_cycles:], peaks[drop_half_cycles:]
    half = _half_heights(at, peaks)
    first = half[np.isfinite(half)]
    small = np.flatnonzero(half < LEAST_AMPLITUDE * first[0]) if first.size else np.empty(0, int)
    last = int(small[0]) if small.size else len(at) - 1
    if last < 3:
        raise ValueError("the motion dies within three half cycles: too few to estimate damping from")
    stop = min(at[last], np.inf if end is None else end)
    used = measured & (time >= at[0]) & (time <= stop)
    if used.sum() < 12:
        raise ValueError("fewer than 12 samples in the cycles to be used")
    at, peaks = at[: last + 1], peaks[: last + 1]
    return _fitted(time, value, used, at, peaks, release, rest, quadratic)


def _release(t: Array, x: Array) -> tuple[float, float]:
    """When the motion was released (NaN where the record begins within it), and from where extremes are counted."""
    noise = 1.4826 * np.median(np.abs(np.diff(x, 2))) / np.sqrt(6) if len(x) > 4 else 0.0
    span = np.ptp(x)
    hold = np.median(x[:HOLD_SAMPLES])
    away = np.abs(x - hold) > max(6 * noise, 0.01 * span)
    first = int(np.argmax(away)) if away.any() else len(x)
    if HOLD_SAMPLES <= first < len(x):
        # x - hold grows with the square of the time since the release: the root is linear
        rise = np.flatnonzero(np.abs(x - hold) < 0.3 * span)
        rise = rise[(rise >= first) & (rise < first + max(3, len(rise)))][:4]
        if rise.size >= 2:
            slope, offset = np.polyfit(t[rise], np.sqrt(np.abs(x[rise] - hold)), 1)
            moment = -offset / slope if slope > 0 else t[first]
            moment = float(np.clip(moment, t[max(0, first - 3)], t[first]))
        else:
            moment = float(t[first])
        return moment, moment
    largest = int(np.argmax(np.abs(x - np.median(x[-max(5, len(x) // 4) :]))))
    return float("nan"), float(t[largest])


def _extremes(t: Array, x: Array, begin: float, rest: float) -> tuple[Array, Array]:
    """Times and values of the alternate extremes after `begin`, each by a parabola through the samples about it."""
    after = t >= begin
    t, y = t[after], x[after] - rest
    sign = np.sign(y)
    for i in range(1, len(sign)):
        if sign[i] == 0:
            sign[i] = sign[i - 1]
    edges = np.concatenate([[0], np.flatnonzero(sign[1:] != sign[:-1]) + 1, [len(y)]])
    spans = np.diff(edges)
    # zero crossings within noise, or beside a gap, leave pieces; a half cycle is at least a third of the typical length
    typical = np.median(spans[spans > 0.3 * spans.max()]) if spans.size else 0
    times: list[float] = []
    values: list[float] = []
    for lo, hi in pairwise(edges.tolist()):
        if hi - lo < max(3, 0.35 * typical):
            if times and hi < len(y) and np.abs(y[lo:hi]).max() < LEAST_AMPLITUDE * abs(values[0]):
                break
            continue
        k = lo + int(np.argmax(np.abs(y[lo:hi])))
        wide = max(2, (hi - lo) // 5)
        near = slice(max(lo, k - wide), min(hi, k + wide + 1))
        if hi == len(y) and k >= hi - 2:
            continue
        if near.stop - near.start >= 3 and lo < k < hi - 1:
            c2, c1, c0 = np.polyfit(t[near] - t[k], y[near], 2)
            if c2 * y[k] < 0:
                s = float(np.clip(-c1 / (2 * c2), t[near][0] - t[k], t[near][-1] - t[k]))
                times.append(t[k] + s)
                values.append(c0 + c1 * s + c2 * s * s)
                continue
        times.append(float(t[k]))
        values.append(float(y[k]))
    return np.array(times), np.array(values) + rest


def _half_heights(at: Array, peaks: Array) -> Array:
    """Half the distance between successive extremes (n - 1,); NaN where one between them is missing."""
    apart = np.diff(at)
    usual = np.median(apart)
    whole = (np.abs(apart / usual - 1) < 0.3) & (np.diff(np.sign(peaks - np.median(peaks))) != 0)
    heights: Array = np.where(whole, np.abs(np.diff(peaks)) / 2, np.nan)
    return heights


def _decrement(at: Array, peaks: Array) -> tuple[Extremes, Estimate, Estimate]:
    """Linear and quadratic damping by the decrement of half cycles."""
    amplitude = _half_heights(at, peaks)
    decrement = np.log(amplitude[:-1] / amplitude[1:])
    middle = np.sqrt(amplitude[:-1] * amplitude[1:])
    extremes = Extremes((at[:-1] + at[1:]) / 2, amplitude, decrement)
    decrement, middle = decrement[np.isfinite(decrement)], middle[np.isfinite(decrement)]
    if decrement.size < 3:
        nothing = Estimate(float("nan"), float("nan"))
        return extremes, nothing, nothing
    weights = middle / middle.max()
    solution = np.zeros(2)
    for _ in range(DECREMENT_PASSES):
        slope = middle * _second_order(solution[0], solution[1], middle)
        J = np.column_stack([np.ones_like(middle), slope]) * weights[:, None]
        solution, *_ = np.linalg.lstsq(J, decrement * weights, rcond=None)
    covariance = parameter_covariance(J, decrement * weights - J @ solution)
    sd = np.sqrt(np.diag(covariance)) * t_factor(decrement.size - 2)
    delta = solution[0] / np.pi
    zeta = delta / np.sqrt(1 + delta**2)
    return (
        extremes,
        Estimate(float(zeta), float(sd[0] / np.pi)),
        Estimate(float(0.75 * solution[1]), float(0.75 * sd[1])),
    )


def _second_order(alpha: float, c: float, a: Array) -> Array:
    """By what the quadratic term c a of a decrement is to be multiplied, (n,); alpha: the linear term.

    To first order in c and any alpha = pi d the decrement of an extreme has the factor
    cosh(alpha/2) (1 + d^2) / (1 + d^2/9), from the integral of exp(-d u) sin^3(u) over a half cycle; half of the
    quadratic term acts as more of alpha. Heights between two extremes are means of two of them: 1 + decrement^2 / 4.
    """
    own = alpha + c * a / 2
    d = own / np.pi
    factor: Array = np.cosh(own / 2) * (1 + d**2) / (1 + d**2 / 9) * (1 + (alpha + c * a) ** 2 / 4)
    return factor


def _fitted(
    t: Array, x: Array, used: Bools, at: Array, peaks: Array, release: float, rest: float, quadratic: bool
) -> Decay:
    from scipy.optimize import least_squares

    extremes, p, q = _decrement(at, peaks)
    ts, xs = t[used], x[used]
    half_period = float(np.median(np.diff(at)))
    zeta0 = float(np.clip(p.value if np.isfinite(p.value) else 0.01, 1e-4, 0.5))
    wn0 = np.pi / half_period / np.sqrt(1 - zeta0**2)
    scale = float(np.abs(peaks - rest).max())
    b0 = max(0.0, q.value) * scale if quadratic and np.isfinite(q.value) else 0.0
    # length unit: the first amplitude, so that all unknowns are of order one
    start = np.array([1.0, zeta0, (peaks[0] - rest) / scale, 0.0, 0.0, b0])
    free = [0, 1, 2, 3, 4, *([5] if quadratic else [])]

    def motion(unknown: Array) -> Array:
        full = start.copy()
        full[free] = unknown
        full[5] = full[5] if quadratic else 0.0
        w, zeta, y0, v0, c, b = full
        shifted: Array = c + integrated(ts, wn0 * w, zeta, b, y0, v0 * wn0)
        return shifted

    ys = (xs - rest) / scale

    def misfit(unknown: Array) -> Array:
        return motion(unknown) - ys

    answer = least_squares(misfit, start[free], x_scale="jac", method="trf", xtol=1e-14, ftol=1e-14)
    residual = answer.fun
    covariance = parameter_covariance(np.asarray(answer.jac), residual)
    factor = t_factor(len(residual) - len(free))
    w, zeta = float(answer.x[0]), float(answer.x[1])
    b = float(answer.x[5]) if quadratic else 0.0
    root = np.sqrt(1 - zeta**2)
    damped = 2 * np.pi / (wn0 * w * root)
    gradient = np.array([-damped / w, damped * zeta / root**2])
    fitted = np.full(x.shape, np.nan)
    fitted[used] = (residual + ys) * scale + rest
    width = factor * np.sqrt(np.diag(covariance))
    return Decay(
        Td=Estimate(float(damped), float(factor * np.sqrt(gradient @ covariance[:2, :2] @ gradient))),
        fn=Estimate(float(wn0 * w / (2 * np.pi)), float(wn0 * width[0] / (2 * np.pi))),
        zeta=Estimate(zeta, float(width[1])),
        b=Estimate(b / scale, float(width[5] / scale) if quadratic else 0.0),
        rest=Estimate(float(rest + answer.x[4] * scale), float(width[4] * scale)),
        release=release,
        used=used,
        fitted=fitted,
        cycles=float((ts[-1] - ts[0]) / damped),
        rms=float(np.sqrt(np.mean(residual**2)) * scale),
        p=p,
        q=q,
        extremes=extremes,
    )


def integrated(t: Array, wn: float, zeta: float, b: float, y0: float, v0: float) -> Array:
    """The solution of y'' + 2 zeta wn y' + b |y'| y' + wn^2 y = 0 at the times t (n,), s; y0, v0 at t[0].

    The linear equation has its closed form; with b it is integrated by the classical Runge-Kutta method on a regular
    grid of STEPS_A_PERIOD and read off by the cubic through values and slopes.
    """
    elapsed = t - t[0]
    if b == 0.0 and abs(zeta) < 1:
        wd = wn * np.sqrt(1 - zeta**2)
        swing = y0 * np.cos(wd * elapsed) + (v0 + zeta * wn * y0) / wd * np.sin(wd * elapsed)
        decayed: Array = np.exp(-zeta * wn * elapsed) * swing
        return decayed
    n = max(4, int(np.ceil(elapsed[-1] * wn / (2 * np.pi) * STEPS_A_PERIOD)) + 1)
    h = elapsed[-1] / n
    ys, vs = np.empty(n + 1), np.empty(n + 1)
    y, v = float(y0), float(v0)
    c, k = 2 * zeta * wn, wn * wn
    for i in range(n + 1):
        ys[i], vs[i] = y, v
        a1 = -c * v - b * abs(v) * v - k * y
        v2 = v + h / 2 * a1
        a2 = -c * v2 - b * abs(v2) * v2 - k * (y + h / 2 * v)
        v3 = v + h / 2 * a2
        a3 = -c * v3 - b * abs(v3) * v3 - k * (y + h / 2 * v2)
        v4 = v + h * a3
        a4 = -c * v4 - b * abs(v4) * v4 - k * (y + h * v3)
        y += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    i = np.minimum((elapsed / h).astype(int), n - 1)
    s = elapsed / h - i
    d = ys[i + 1] - ys[i]
    read_off: Array = (
        ys[i] + s * h * vs[i] + s * s * (3 * d - h * (2 * vs[i] + vs[i + 1])) + s**3 * (h * (vs[i] + vs[i + 1]) - 2 * d)
    )
    return read_off


def pooled(estimates: ArrayLike) -> Estimate:
    """The mean of repeats (n, 2) of value and half width, weighted by what each knows and by how far they scatter.

    The scatter between repeats beyond what their half widths explain is estimated by moments (DerSimonian and Laird,
    1986) and added to each; the interval is never narrower than the scatter shows (type A, Student's t).
    """
    values, width = np.asarray(estimates, float).T
    good = np.isfinite(values) & np.isfinite(width) & (width > 0)
    values, variance = values[good], (width[good] / 1.96) ** 2
    if values.size == 0:
        return Estimate(float("nan"), float("nan"))
    w = 1 / variance
    mean = np.sum(w * values) / w.sum()
    excess = np.sum(w * (values - mean) ** 2) - (values.size - 1)
    between = max(0.0, excess / (w.sum() - np.sum(w**2) / w.sum())) if values.size > 1 else 0.0
    w = 1 / (variance + between)
    mean = float(np.sum(w * values) / w.sum())
    factor = t_factor(values.size - 1) if between > 0 else 1.96
    return Estimate(mean, float(factor / np.sqrt(w.sum())))
