"""What a target in a start box is taken for as long as nothing of it is known: much light near the middle of its box.

Where what lies nearer to the middle has far more light than all else, the target is that. If it cannot be measured
now, because it touches something, the target is not measured: a stroke of the wall beside it is another thing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.detection.blobs import Blobs


@dataclass(frozen=True)
class FirstSight:
    """What of a start box is its target.

    light   cost of what has no light, beside 0 to 1 for how far it is from the middle
    outdone times its light that a thing has which it cannot be the target beside
    same_px between two samples, within which a thing that stands still is the same
    again   samples from a first sight to the second, at least
    """

    light: float = 3.0
    outdone: float = 2.0
    same_px: float = 2.0
    again: float = 0.5


FIRST_SIGHT = FirstSight()


def by_light(mass: Array) -> Array:
    """Cost (m,) of things of so much light, grey levels summed: 0 of the brightest of all."""
    light = np.log1p(np.maximum(mass, 0))
    return np.asarray(FIRST_SIGHT.light * (1 - light / max(float(light.max(initial=0.0)), 1.0)))


class FirstSights:
    """What is known of the first sights of so many places."""

    def __init__(self, places: int) -> None:
        self._time = np.full(places, np.nan)
        self._outdone: dict[int, list[Array]] = {}

    def seen(self, who: Ints, time: float) -> None:
        """Targets, of which nothing was known, are seen in the sample at this time, samples."""
        self._time[who] = time

    def confirmed(self, who: Ints, missing: Ints, time: float) -> Bools:
        """Which of the targets (m,), missing for so many samples now, were seen again after their first sight: what was
        seen once in a start box may be anything, and says nothing of what is to be sought elsewhere.
        """
        return np.asarray(~(time - missing < self._time[who] + FIRST_SIGHT.again))

    def without_outdone(self, cost: Array, off: Array, things: Blobs, who: Ints, unseen: Bools) -> Array:
        """Costs (n, m) of things for targets `who` (n,), inf also where, for one that was not seen yet (n,), another
        has far more light and lies nearer to the middle, but cannot be measured, for its cost is inf; or had before.

        off   (n, m) how far things are from the middles of the boxes; inf: outside
        """
        if not unseen.any():
            return cost
        stands = np.isinf(cost) & np.isfinite(off)
        more = things.mass[:, None] > FIRST_SIGHT.outdone * things.mass  # the first has more than the second
        nearer = off[:, :, None] < off[:, None, :]
        outdone = unseen[:, None] & np.isfinite(cost) & (stands[:, :, None] & nearer & more).any(axis=1)
        at = np.stack([things.Xf, things.Yf], axis=1)
        for row, i in zip(np.flatnonzero(unseen).tolist(), who[unseen].tolist(), strict=True):
            before = self._outdone.setdefault(i, [])
            for place in before:
                outdone[row] |= np.hypot(*(at - place).T) < FIRST_SIGHT.same_px
            new = at[outdone[row]]
            before += [place for place in new if all(np.hypot(*(place - old)) >= FIRST_SIGHT.same_px for old in before)]
        return np.where(outdone, np.inf, cost)
