"""Run-up as it is quoted: set-up, swash, and the height that 2 % of the run-up maxima exceed.

S = 4 sd of the run-up about its mean; its infragravity and incident parts lie below and above a frequency (Stockdon,
Holman, Howd and Sallenger 2006, Coastal Engineering 53: 573-588, who part them at 0.05 Hz).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array

FEWEST = 64
"""Samples below which the swash is not divided by frequency."""


class RunUp(NamedTuple):
    """World units; above the still water's level where it was given, else above z = 0.

    setup   mean of the run-up; S: 4 sd about it; Sinc, Sig: its parts above and below the frequency
    R2      exceeded by 2 % of the maxima between upward crossings of the mean; Rmax: the highest
    Tz      s, mean time between upward crossings; n: the maxima
    """

    setup: float
    S: float
    Sinc: float
    Sig: float
    R2: float
    Rmax: float
    Tz: float
    n: int


def run_up(t: ArrayLike, z: ArrayLike, *, still: float = 0.0, part_hz: float = 0.05) -> RunUp:
    """Of a record of run-up: t (n,) s, z (n,) world units, NaN where missing; still: z of the still water."""
    times, height = np.asarray(t, float), np.asarray(z, float) - still
    good = np.isfinite(times) & np.isfinite(height)
    times, height = times[good], height[good]
    if height.size < 3:
        none = float("nan")
        return RunUp(none, none, none, none, none, none, none, 0)
    setup = float(height.mean())
    swash = height - setup
    up = np.flatnonzero((swash[:-1] < 0) & (swash[1:] >= 0))
    maxima = np.array([height[a + 1 : b + 1].max() for a, b in pairwise(up.tolist())])
    moments = times[up] + swash[up] / (swash[up] - swash[up + 1]) * (times[up + 1] - times[up]) if up.size else up
    low, high = _parts(times, swash, part_hz)
    return RunUp(
        setup,
        float(4 * swash.std()),
        high,
        low,
        float(np.quantile(maxima, 0.98)) if maxima.size else float("nan"),
        float(height.max()),
        float(np.diff(moments).mean()) if len(moments) > 1 else float("nan"),
        int(maxima.size),
    )


def _parts(t: Array, swash: Array, part_hz: float) -> tuple[float, float]:
    """4 sqrt of the variance below and above a frequency, of the record on an even grid."""
    if swash.size < FEWEST:
        return float("nan"), float("nan")
    step = float(np.median(np.diff(t)))
    grid = np.arange(t[0], t[-1] + step / 2, step)
    even = np.interp(grid, t, swash)
    power = np.abs(np.fft.rfft(even - even.mean())) ** 2
    f = np.fft.rfftfreq(even.size, step)
    power[1 : -1 if even.size % 2 == 0 else None] *= 2
    variance = power / even.size**2
    low = float(variance[(f > 0) & (f < part_hz)].sum())
    return 4 * float(np.sqrt(low)), 4 * float(np.sqrt(variance[f >= part_hz].sum()))
