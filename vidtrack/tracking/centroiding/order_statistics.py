"""Medians and quantiles of many columns at once, NaN left out: those of numpy, which takes them one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints

FEW = 64
"""Numbers that Python's own sorting orders faster than numpy."""

IN_CACHE = 20_000
"""Numbers that are worked on at once: the processor's caches hold a few times as many."""


def median_of(values: NDArray[Any]) -> float:
    """The median of all numbers of an array, NaN where one is or none is there: numpy's, in a tenth of the time."""
    if not values.size:
        return np.nan
    half, odd = values.size // 2, values.size % 2
    if values.size <= FEW and values.dtype == float:
        few = sorted(values.ravel().tolist())
        middle = few[half] if odd else (few[half - 1] + few[half]) / 2
        return middle if all(one == one for one in few) else np.nan
    halves = np.partition(values, half, axis=None)
    if np.isnan(halves[half:]).any():
        return np.nan
    return float(halves[half] if odd else (halves[:half].max() + halves[half]) / 2)


def row_medians(values: NDArray[Any]) -> NDArray[Any]:
    """Medians over the last axis of arrays of short rows without NaN, of their kind: quicker than numpy's."""
    ordered, k = np.sort(values, axis=-1), values.shape[-1]
    return np.asarray((ordered[..., (k - 1) // 2] + ordered[..., k // 2]) / 2)


def median(values: Array) -> Array:
    """Medians over the last axis but one, (..., n) of (..., k, n); NaN where a column holds nothing else."""
    ordered, count = _ordered(values)
    low, high = (_at(ordered, place) for place in ((count - 1) // 2, count // 2))
    return np.asarray((low + high) / 2)


def quantile(values: Array, share: float) -> Array:
    """As `median`, below which a share of each column lies; between two values linearly."""
    ordered, count = _ordered(values)
    place = share * (count - 1)
    below = np.floor(place).astype(np.intp)
    return _between(_at(ordered, below), _at(ordered, np.minimum(below + 1, count - 1)), place - below)


def _between(low: Array, high: Array, part: Array) -> Array:
    step = high - low
    return np.asarray(np.where(part < 0.5, low + step * part, high - step * (1 - part)))


def middle_and_nearest(values: Array, share: float) -> tuple[Array, Array]:
    """Medians, as `median`, and how far from them the nearest share of each column lies: `quantile` of the distances.

    Of ordered values the nearest ones lie side by side, so that the distances need no ordering of their own.
    """
    ordered, count = _ordered(values)
    middle = (_at(ordered, (count - 1) // 2) + _at(ordered, count // 2)) / 2
    place = share * (count - 1)
    below = np.floor(place).astype(np.intp)
    low, high = np.full((2, *count.shape), np.nan)
    for n in np.unique(count[count > 0]).tolist():  # most columns hold as many numbers
        alike, k = np.argwhere(count == n), int(share * (n - 1))
        for first in range(0, len(alike), max(1, IN_CACHE // n)):
            some = tuple(alike[first : first + max(1, IN_CACHE // n)].T)
            off = ordered[some][:, :n] - middle[some][:, None]
            low[some], high[some] = (_nearest(off, min(k + more, n)) for more in (1, 2))
    return np.asarray(middle), _between(low, high, place - below)


def _nearest(off: Array, k: int) -> Array:
    """The k-th smallest by its size of each row of ordered numbers."""
    return np.asarray(np.maximum(-off[:, : off.shape[1] - k + 1], off[:, k - 1 :]).min(axis=1))


def _ordered(values: Array) -> tuple[Array, Ints]:
    """Columns as rows, NaN last, and how many others each holds."""
    rows = np.sort(np.swapaxes(values, -1, -2), axis=-1)
    return rows, np.isfinite(rows).sum(axis=-1)


def _at(ordered: Array, place: Ints) -> Array:
    return np.asarray(np.take_along_axis(ordered, np.maximum(place, 0)[..., None], axis=-1)[..., 0])
