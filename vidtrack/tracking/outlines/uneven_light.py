"""How far light that changes over a target moves its centroid: a shadow along its course, a lamp that comes nearer.

The middle of the rim is where the target is, however it is lit, if the rim is sought on each side half-way down from
the level of that side; the middle of its light is its centroid. A lamp or a shadow that is always at one side parts
them by the same way in all samples: no sample is moved against another, and all lie beside the target. What parts them
more than where they are nearest to each other is an error of the samples in which it does. Looked at with the rims, now
and then, and only where the rim is a whole one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints


@dataclass(frozen=True)
class UnevenLight:
    """When light has moved a centroid.

    fewest   looks at a target from which on it is judged
    nearest  share of the looks, those with the least ways, that show its usual light
    beyond   times the sd of a way, that one is from the usual at least: of plain balls 2 at most, and 4 of coded ones
    others   the same of the ways before and after it, of so many looks
    about
    grid_px  what the grid of pixels adds to that sd
    whole    px that a centroid is off for a px of way: the background beside a shadow moves the rim as well
    steadily  times the sd of the usual way, that it is at least where light is always uneven; steady_px: what the grid
    steady_px adds to that sd
    from_one_side  px that a centroid is off for a px of the usual way: half-way down from a level that itself falls
              towards the rim, the rim goes part of the way. Drawn balls with the edge of a shadow on them: 1 to 2.4
    together  looks that are kept as one: each by itself takes ten times its memory
    """

    fewest: int = 4
    nearest: float = 0.2
    beyond: float = 5.0
    others: float = 1.5
    about: int = 12
    grid_px: float = 0.02
    whole: float = 1.3
    steadily: float = 3.0
    steady_px: float = 0.012
    from_one_side: float = 1.5
    together: int = 256


UNEVEN_LIGHT = UnevenLight()


_Looks = tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]  # samples, targets, ways (2, m), their sd


def _joined(looks: Sequence[_Looks]) -> _Looks:
    sample, who, way, sd = (np.concatenate(parts, axis=-1) for parts in zip(*looks, strict=True))
    return sample.astype(np.int32), who.astype(np.int32), way.astype(np.float32), sd.astype(np.float32)


class Ways:
    """From the centroid to the middle of the rim, of n targets."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._looks: list[_Looks] = []
        self._kept: list[_Looks] = []

    def seen(self, sample: int, who: Ints, way: Array, sd: Array, good: Bools) -> None:
        """Ways (2, m) px of targets `who` in a sample, with their sd (m,) px, where they are good (m,)."""
        if good.any():
            self._looks.append((np.full(np.count_nonzero(good), sample), who[good], way[:, good], sd[good]))
        if len(self._looks) >= UNEVEN_LIGHT.together:
            self._kept.append(_joined(self._looks))
            self._looks = []

    def followed_back(self, back: Ways, moved: Callable[[Ints, Ints], tuple[Ints, Ints, Bools]]) -> None:
        """As `Surfaces.followed_back`."""
        for sample, who, way, sd in [*back._kept, *back._looks]:
            at, here, good = moved(sample.astype(np.intp), who.astype(np.intp))
            self._kept.append(_joined([(at[good], here[good], way[:, good], sd[good])]))

    def grown(self, sd: Array, own: Array, place: Array | None = None) -> Array:
        """sd (2, k, n) px of centroids, with what light adds; own (2, k, n) px: what ways are compared with.

        place  (2, k, n) px: where targets are that a lamp lights from one side, by ways that change with the place
        """
        if not self._looks and not self._kept:
            return sd
        sample, who, way, noise = _joined([*self._kept, *self._looks])
        every, out = np.arange(sd.shape[1]), sd
        for i in np.unique(who).tolist():
            rows = np.flatnonzero(who == i)
            rows = rows[np.unique(sample[rows], return_index=True)[1]]
            if rows.size < UNEVEN_LIGHT.fewest:
                continue
            at, to = sample[rows], way[:, rows]
            if place is not None:
                to = _without_trend(to, place[:, at, i])
            size = np.hypot(*to)
            usual = to[:, size <= np.quantile(size, UNEVEN_LIGHT.nearest)].mean(axis=1)
            off = np.hypot(*(to - usual[:, None]))
            limit = np.hypot(np.hypot(noise[rows], np.fmax(*np.nan_to_num(own[:, at, i]))), UNEVEN_LIGHT.grid_px)
            steady = np.hypot(*np.median(to, axis=1))
            known = np.hypot(np.median(noise[rows]) / np.sqrt(rows.size), UNEVEN_LIGHT.steady_px)
            if steady > UNEVEN_LIGHT.steadily * known:
                out = sd.copy() if out is sd else out
                out[:, :, i] = np.hypot(out[:, :, i], UNEVEN_LIGHT.from_one_side * steady)
            if not (plainly := np.flatnonzero(off > UNEVEN_LIGHT.beyond * limit)).size:
                continue
            off = np.where((off > UNEVEN_LIGHT.others * limit) & _near(plainly, off.size), off, 0.0)
            after = np.minimum(np.searchsorted(at, every), at.size - 1)
            before = np.maximum(np.searchsorted(at, every, side="right") - 1, 0)
            out = sd.copy() if out is sd else out
            out[:, :, i] = np.hypot(out[:, :, i], UNEVEN_LIGHT.whole * np.maximum(off[before], off[after]))
        return out


def _without_trend(way: Array, place: Array) -> Array:
    """Ways (2, m) px without what changes evenly with the place (2, m) px, by those that are near that."""
    known = np.isfinite(place).all(axis=0)
    terms = np.stack([np.ones(way.shape[1]), *np.nan_to_num(place - np.nanmean(place, axis=1)[:, None])])
    for _ in range(3):
        if known.sum() <= 2 * len(terms):
            return way
        shape = np.linalg.lstsq(terms[:, known].T, way[:, known].T, rcond=1e-6)[0]
        left = np.hypot(*(way - shape.T @ terms))
        known &= left <= 3 * np.median(left[known]) + 1e-9
    return np.asarray(way - shape.T @ terms)


def _near(which: Ints, n: int) -> Bools:
    """Which of n looks are about one of these."""
    last = np.searchsorted(which, np.arange(n), side="right") - 1
    before = np.where(last >= 0, np.arange(n) - which[np.maximum(last, 0)], n)
    after = np.where(last + 1 < which.size, which[np.minimum(last + 1, which.size - 1)] - np.arange(n), n)
    return np.asarray(np.minimum(before, after) <= UNEVEN_LIGHT.about)
