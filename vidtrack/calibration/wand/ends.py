"""Which ball of a picture is which end of the wand.

Balls look alike. Within a stretch in which a tracker keeps its balls apart, it is one question for the whole stretch
which of them is end A; three balls on one line are ordered by the line, and where their distances differ, by them.
"""

from __future__ import annotations

from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints


class EndSettings(NamedTuple):
    """When a track may have changed its ball."""

    close: float = 6.0
    """px: balls that come nearer to each other than this may be exchanged."""
    gap: int = 3
    """Moments without a ball after which it may be another one."""
    clear: float = 1.25
    """Times by which the distances on a wand of three balls must differ before they order it."""


SETTINGS = EndSettings()


def orders(lengths: Array) -> list[tuple[int, ...]]:
    """The ways in which the q balls of a picture can be the q ends, once `ordered` has sorted what it can.

    lengths  (q, q) distances between the ends, world units
    """
    q = len(lengths)
    if q == 2:
        return [(0, 1), (1, 0)]
    if not collinear(lengths):
        return list(permutations(range(q)))
    first, last = outer(lengths)
    return [(0, 1, 2)] if unequal(lengths) else [(0, 1, 2), _exchanged(first, last)]


def _exchanged(first: int, last: int) -> tuple[int, ...]:
    order = [0, 1, 2]
    order[first], order[last] = last, first
    return tuple(order)


def collinear(lengths: Array) -> bool:
    """Whether three ends lie on one line, to 1 % of the wand."""
    sides = np.sort(lengths[np.triu_indices(3, 1)])
    return bool(sides[0] + sides[1] - sides[2] < 0.01 * sides[2])


def outer(lengths: Array) -> tuple[int, int]:
    """The two of three ends that are farthest apart."""
    i, j = np.unravel_index(int(np.argmax(lengths)), lengths.shape)
    return (int(min(i, j)), int(max(i, j)))


def unequal(lengths: Array) -> bool:
    """Whether the middle ball is so much nearer to one end that a picture shows which end that is."""
    first, last = outer(lengths)
    middle = 3 - first - last
    near, far = sorted((lengths[first, middle], lengths[last, middle]))
    return bool(far > SETTINGS.clear * near)


def ordered(b: Array, lengths: Array) -> Array:
    """Balls (n, 3, 2) px in the order of the ends, as far as the picture shows it; other numbers of balls as they are.

    On a straight wand the ball between the others is the end between the others, in every picture. Moments with a
    ball missing become NaN: which one is missing is not known.
    """
    if b.shape[1] != 3 or not collinear(lengths):
        return b
    first, last = outer(lengths)
    middle = 3 - first - last
    apart = np.linalg.norm(b[:, [1, 2, 0]] - b[:, [2, 0, 1]], axis=-1)  # opposite to ball 0, 1, 2
    whole = np.isfinite(apart).all(-1)
    between = np.where(whole, np.nan_to_num(apart, nan=-1.0).argmax(-1), 0)
    rows = np.arange(len(b))
    one, other = (between + 1) % 3, (between + 2) % 3
    if unequal(lengths):
        to_one = np.linalg.norm(b[rows, one] - b[rows, between], axis=-1)
        to_other = np.linalg.norm(b[rows, other] - b[rows, between], axis=-1)
        swap = (to_one < to_other) != (lengths[first, middle] < lengths[last, middle])
        one, other = np.where(swap, other, one), np.where(swap, one, other)
    out = np.full(b.shape, np.nan)
    out[:, middle], out[:, first], out[:, last] = b[rows, between], b[rows, one], b[rows, other]
    out[~whole] = np.nan
    return out


def stretches(b: Array) -> Ints:
    """A number (n,) for each moment of a camera's tracks (n, q, 2): the same while every ball keeps its track."""
    n, q = b.shape[:2]
    seen = np.isfinite(b).all((-1, -2))
    cut = np.zeros(n, bool)
    for i in range(q):
        for j in range(i + 1, q):
            near = np.linalg.norm(b[:, i] - b[:, j], axis=-1) < SETTINGS.close
            cut[1:] |= near[1:] != near[:-1]
    there = np.flatnonzero(seen)
    for before, after in pairwise(there.tolist()):
        if after - before > SETTINGS.gap:
            cut[after] = True
    return np.cumsum(cut)


def jointly(each: list[Ints]) -> Ints:
    """The stretches of several cameras together: a new one begins where one of theirs does."""
    cut = np.zeros(len(each[0]), bool)
    for own in each:
        cut[1:] |= own[1:] != own[:-1]
    return np.cumsum(cut)


def chosen(cost: Array, stretch: Ints, most: float) -> tuple[Ints, Array]:
    """The order of least cost in each stretch: its index (n,) and the cost (n,) of every moment under it.

    cost  (n_orders, n), NaN where it cannot be computed; a moment counts with at most `most`
    """
    n = cost.shape[1]
    capped = np.where(np.isfinite(cost), np.minimum(cost, most), 0.0)
    sums = np.stack([np.bincount(stretch, row, stretch.max() + 1) for row in capped])
    best = sums.argmin(0)[stretch]
    return best, cost[best, np.arange(n)]


def complete(b: Array) -> Bools:
    """(n,) the moments at which all balls are seen."""
    return np.asarray(np.isfinite(b).all((-1, -2)))
