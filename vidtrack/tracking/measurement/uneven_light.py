"""How far light that changes over a target moves its centroid: a shadow along its course, a lamp that comes nearer.

The middle of the rim is where the target is, however it is lit; the middle of its light is its centroid. A lamp that is
always at one side parts them by the same way in all samples, which moves no sample against another. What parts them
more than where they are nearest to each other is an error of the samples in which it does. Looked at with the rims, now
and then, and only where the rim is a whole one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints


@dataclass(frozen=True)
class UnevenLight:
    """When light has moved a centroid.

    fewest   looks at a target from which on it is judged
    nearest  share of the looks, those with the least ways, that show its usual light
    beyond   times the sd of a way, that one is from the usual at least: of plain balls 2 at most, and 4 of coded ones
    others   the same of the other ways of a target of which one is
    grid_px  what the grid of pixels adds to that sd
    whole    px that a centroid is off for a px of way: the background beside a shadow moves the rim as well
    """

    fewest: int = 4
    nearest: float = 0.2
    beyond: float = 5.0
    others: float = 1.5
    grid_px: float = 0.02
    whole: float = 1.3


UNEVEN_LIGHT = UnevenLight()


class Ways:
    """From the centroid to the middle of the rim, of n targets."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._looks: list[tuple[Ints, Ints, Array, Array]] = []

    def seen(self, sample: int, who: Ints, way: Array, sd: Array, good: Bools) -> None:
        """Ways (2, m) px of targets `who` in a sample, with their sd (m,) px, where they are good (m,)."""
        if good.any():
            self._looks.append((np.full(np.count_nonzero(good), sample), who[good], way[:, good], sd[good]))

    def sd(self, sd: Array) -> Array:
        """px (2, k, n), what light adds to the sd (2, k, n) of centroids; 0 where nothing of it is seen."""
        out = np.zeros(sd.shape)
        if not self._looks:
            return out
        sample, who, way, noise = (np.concatenate(parts, axis=-1) for parts in zip(*self._looks, strict=True))
        every = np.arange(sd.shape[1])
        for i in np.unique(who).tolist():
            own = np.flatnonzero(who == i)
            own = own[np.unique(sample[own], return_index=True)[1]]
            if own.size < UNEVEN_LIGHT.fewest:
                continue
            at, to = sample[own], way[:, own]
            size = np.hypot(*to)
            usual = to[:, size <= np.quantile(size, UNEVEN_LIGHT.nearest)].mean(axis=1)
            off = np.hypot(*(to - usual[:, None]))
            limit = np.hypot(np.hypot(noise[own], np.fmax(*np.nan_to_num(sd[:, at, i]))), UNEVEN_LIGHT.grid_px)
            if not (off > UNEVEN_LIGHT.beyond * limit).any():
                continue
            off = np.where(off > UNEVEN_LIGHT.others * limit, off, 0.0)
            after = np.minimum(np.searchsorted(at, every), at.size - 1)
            before = np.maximum(np.searchsorted(at, every, side="right") - 1, 0)
            out[:, :, i] = UNEVEN_LIGHT.whole * np.maximum(off[before], off[after])
        return out
