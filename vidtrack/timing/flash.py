"""Two cameras' clocks from a light that both saw switched on or off.

A picture holds the mean light of its exposure. When the light changes during one, that picture lies between dark
and bright by just the share of the exposure that was left: with the shutter open all the time the moment is

    t = sum(d_k t_k) / sum(d_k),   d_k = L_k - L_(k-1) about the change, t_k when exposure k began

exact for a sudden change, whatever its phase in the picture. A flash much shorter than a picture falls into one and
tells no more than which.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.camera import Array
from vidtrack.timing.clock import RATE_PRIOR_PPM, Clock
from vidtrack.timing.resample import interval
from vidtrack.timing.sound import Timing


def light_changes(t: ArrayLike, level: ArrayLike, *, shutter: float = 1.0) -> tuple[Array, Array, Array]:
    """Moments (m,), s, at which the light changed, by how much (m,), grey levels, and their standard errors (m,), s.

    t        (n,)  s, when each exposure began, rising
    level    (n,)  mean brightness of each picture; NaN where lost
    shutter  share of the interval during which the shutter is open: what happens while it is shut is known
             only to that extent
    A change counts from ten times the usual flicker; a ramp over many pictures is a change at its middle.
    """
    times, light = np.asarray(t, float), np.asarray(level, float)
    times, light = times[np.isfinite(light)], light[np.isfinite(light)]
    if times.size < 4:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    d, step = np.diff(light), interval(times)
    flicker = max(1.4826 * float(np.median(np.abs(d - np.median(d)))), 1e-9)
    key = np.where(np.abs(d) > 10 * flicker, np.sign(d), 0)
    runs = _runs(key)
    found: list[tuple[float, float, float]] = []
    for i, (first, last) in enumerate(runs):
        if found and i and first == runs[i - 1][1] + 1:
            # back at once: a flash within that picture, and no more is known
            moment, change, _ = found[-1]
            found[-1] = (moment + 0.5 * step, change, step / np.sqrt(12))
            continue
        # the picture on either side may hold a share of the change that is lost in the flicker
        run = np.array(
            [k for k in range(first - 1, last + 2) if first <= k <= last or (0 <= k < d.size and not key[k])]
        )
        change = float(d[run].sum())
        moment = float(np.sum(d[run] * times[run + 1])) / change
        begun = times[np.searchsorted(times, moment, "right") - 1]
        shut = (1 - shutter) * step / np.sqrt(12)
        error = float(np.hypot(flicker / abs(change) * step * np.sqrt(run.size), shut))
        found.append((begun + (moment - begun) * shutter, change, error))
    at, size, sd = np.array(found).reshape(-1, 3).T
    return at, size, sd


def _runs(key: Array) -> list[tuple[int, int]]:
    """First and last index of every stretch of one value that is not 0."""
    edges = [0, *(np.flatnonzero(np.diff(key)) + 1).tolist(), key.size]
    return [(a, b - 1) for a, b in pairwise(edges) if key[a] != 0]


def timing_from_flash(
    t_a: ArrayLike, level_a: ArrayLike, t_b: ArrayLike, level_b: ArrayLike, *, shutter: float = 1.0
) -> Timing:
    """The clock of camera b that makes its changes of light fall on camera a's.

    Times and levels as for `light_changes`. Changes are paired in the one way that lets most of them agree to
    within a picture. The rate is told from three changes or more; NaN where there is none in common.
    """
    a, size_a, sd_a = light_changes(t_a, level_a, shutter=shutter)
    b, size_b, sd_b = light_changes(t_b, level_b, shutter=shutter)
    if not a.size or not b.size:
        return Timing(Clock(), Clock(np.nan, np.nan), 0, 0)
    slack = 0.75 * max(interval(t_a), interval(t_b))
    difference = a[:, None] - b
    alike = np.sign(size_a)[:, None] == np.sign(size_b)
    if not alike.any():
        return Timing(Clock(), Clock(np.nan, np.nan), 0, max(a.size, b.size))
    near = [alike & (np.abs(difference - offset) < slack) for offset in difference[alike]]
    i, j = np.nonzero(max(near, key=np.count_nonzero))
    lag, sd = difference[i, j], np.maximum(np.hypot(sd_a[i], sd_b[j]), 1e-6)
    # a line through the lags, the slope near 0 unless they tell it
    A = np.stack([1 / sd, (b[j] - float(np.asarray(t_b, float)[0])) / sd], -1)
    covariance = np.linalg.inv(A.T @ A + np.diag([0, (RATE_PRIOR_PPM * 1e-6) ** -2]))
    offset, rate = covariance @ (A.T @ (lag / sd))
    # where the moments scatter by more than the flicker explains, so does the answer
    off = lag / sd - A @ (offset, rate)
    error = np.sqrt(np.diag(covariance) * max(1.0, float(off @ off) / max(lag.size - 1, 1)))
    return Timing(
        Clock(float(offset), float(rate * 1e6)),
        Clock(float(error[0]), float(error[1] * 1e6)),
        lag.size,
        max(a.size, b.size),
    )
