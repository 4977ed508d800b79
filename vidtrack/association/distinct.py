"""Distinct pairs of numbers from 0 on, such as tracklets of two cameras, or a group and a moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Ints

FULL = 8
"""Possible pairs for each that there is, up to which they are counted in a table of all; more are sorted."""


def distinct_pairs(a: Ints, b: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """The distinct pairs (P,), rising, of pairs of numbers (n,); which of them each is (n,), and how many are (P,)."""
    width = int(b.max(initial=0)) + 1
    if (int(a.max(initial=0)) + 1) * width <= FULL * a.size:
        key = a * width + b
        there = np.zeros(int(key.max(initial=-1)) + 1, bool)
        there[key] = True
        kept = np.flatnonzero(there)
        number = np.empty(there.size, np.int32)
        number[kept] = np.arange(kept.size)
        pair = number[key].astype(np.intp)
        return *np.divmod(kept, width), pair, np.bincount(pair, minlength=kept.size)
    order = np.argsort(short(b), kind="stable")
    order = order[np.argsort(short(a)[order], kind="stable")]
    low, high = a[order], b[order]
    new = np.ones(a.size, bool)
    new[1:] = (np.diff(low) != 0) | (np.diff(high) != 0)
    first = np.flatnonzero(new)
    pair = np.empty(a.size, np.intp)
    pair[order] = np.cumsum(new) - 1
    return low[first], high[first], pair, np.diff(np.append(first, a.size))


def short(numbers: Ints) -> NDArray[np.unsignedinteger]:
    """The same from 0 on in as few bytes as hold them: integers of two bytes are sorted in linear time."""
    return numbers.astype(np.min_scalar_type(int(numbers.max(initial=0))))
