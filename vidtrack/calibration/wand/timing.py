"""By how much a camera's clock is off another's, from balls that both follow, before anything of the cameras is known.

Only at the right moment do the balls of both cameras fit a fundamental matrix. The misfit of the linear equations is
computed over all shifts, coarsely and then finely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.wand.ends import jointly
from vidtrack.calibration.wand.pairs import algebraic_misfit
from vidtrack.timing.resample import interval, resample


class ShiftSettings(NamedTuple):
    """How a shift is sought."""

    most: float = 20.0
    """s, the largest shift."""
    overlap: int = 60
    """Moments that must be common at a shift."""
    points: int = 400
    """Balls that are used at most."""
    sure: float = 1.3
    """Times by which the misfit elsewhere must be larger for a shift to be accepted."""


SETTINGS = ShiftSettings()


class Shift(NamedTuple):
    """What is to be added to the second camera's times, s."""

    seconds: float
    sure: bool  # whether no other shift fits nearly as well


def find_shift(
    ta: Array,
    a: Array,
    tb: Array,
    b: Array,
    orders: list[tuple[int, ...]],
    stretch: tuple[Ints, Ints],
    *,
    near: float = 0.0,
) -> Shift | None:
    """The shift between tracks a (T, q, 2) at ta (T,) s and b at tb; None where they have too little in common.

    stretch  of each track (T,), within which its balls keep their order
    near     s, the middle of the shifts that are tried
    """
    step = max(interval(ta), interval(tb))
    half = min(SETTINGS.most, (ta[-1] - ta[0] + tb[-1] - tb[0]) / 2)
    count = int(half / step)
    tried = near + step * np.arange(-count, count + 1)
    misfit = np.array([_misfit(ta, a, tb, b, orders, stretch, s) for s in tried])
    if not np.isfinite(misfit).any():
        return None
    k = int(np.nanargmin(misfit))
    far = np.abs(tried - tried[k]) > 0.5
    others = misfit[far & np.isfinite(misfit)]
    sure = bool(others.size == 0 or others.min() > SETTINGS.sure * misfit[k])
    best, reach = float(tried[k]), step
    for _ in range(8):
        around = best + reach * np.linspace(-1, 1, 5)
        each = np.array([_misfit(ta, a, tb, b, orders, stretch, s) for s in around])
        if not np.isfinite(each).any():
            break
        best, reach = float(around[int(np.nanargmin(each))]), reach / 2
    return Shift(best, sure)


def _misfit(
    ta: Array,
    a: Array,
    tb: Array,
    b: Array,
    orders: list[tuple[int, ...]],
    each: tuple[Ints, Ints],
    shift: float,
) -> float:
    """The least misfit over the orders of the balls, in the longest stretch in which they keep their order."""
    seen = resample(tb + shift, b.transpose(1, 0, 2), ta).values.transpose(1, 0, 2)
    both = np.isfinite(seen).all((-1, -2)) & np.isfinite(a).all((-1, -2))
    if both.sum() < SETTINGS.overlap:
        return np.inf
    nearest = np.clip(np.searchsorted(tb + shift, ta - 1e-6), 0, len(tb) - 1)
    stretch = jointly([each[0], each[1][nearest]])
    longest = np.bincount(stretch[both]).argmax()
    rows = np.flatnonzero(both & (stretch == longest))
    if len(rows) < SETTINGS.overlap:
        return np.inf
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), SETTINGS.points // a.shape[1])).astype(int)]
    return min(algebraic_misfit(a[rows].reshape(-1, 2), seen[rows][:, list(o)].reshape(-1, 2)) for o in orders)
