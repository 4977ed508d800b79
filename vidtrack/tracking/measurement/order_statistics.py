"""Medians and quantiles of many columns at once, NaN left out: those of numpy, which takes them one by one."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array, Ints


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
    for i in np.ndindex(count.shape):
        if n := int(count[i]):
            off = ordered[i][:n] - middle[i]
            low[i], high[i] = (_nearest(off, min(int(below[i]) + k, n)) for k in (1, 2))
    return np.asarray(middle), _between(low, high, place - below)


def _nearest(off: Array, k: int) -> float:
    """The k-th smallest of ordered numbers, by their size."""
    return float(np.maximum(-off[: off.size - k + 1], off[k - 1 :]).min())


def _ordered(values: Array) -> tuple[Array, Ints]:
    """Columns as rows, NaN last, and how many others each holds."""
    rows = np.sort(np.swapaxes(values, -1, -2), axis=-1)
    return rows, np.isfinite(rows).sum(axis=-1)


def _at(ordered: Array, place: Ints) -> Array:
    return np.asarray(np.take_along_axis(ordered, np.maximum(place, 0)[..., None], axis=-1)[..., 0])
