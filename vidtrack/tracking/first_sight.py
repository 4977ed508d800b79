"""What a target in a start box is taken for as long as nothing of it is known: much light near the middle of its box.

Where what lies nearer to the middle has far more light than all else, the target is that. If it cannot be measured
now, because it touches something, the target is not measured: a stroke of the wall beside it is another thing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools


@dataclass(frozen=True)
class FirstSight:
    """What of a start box is its target.

    light   cost of what has no light, beside 0 to 1 for how far it is from the middle
    outdone times its light that a thing has which it cannot be the target beside
    """

    light: float = 3.0
    outdone: float = 2.0


FIRST_SIGHT = FirstSight()


def by_light(mass: Array) -> Array:
    """Cost (m,) of things of so much light, grey levels summed: 0 of the brightest of all."""
    light = np.log1p(np.maximum(mass, 0))
    return np.asarray(FIRST_SIGHT.light * (1 - light / max(float(light.max(initial=0.0)), 1.0)))


def without_outdone(cost: Array, off: Array, mass: Array, unseen: Bools) -> Array:
    """Costs (n, m) of things for targets, inf also where for one that was not seen yet (n,) another thing has far more
    light and lies nearer to the middle, but cannot be measured: its cost is inf.

    off   (n, m) how far things are from the middles of the boxes; inf: outside; mass (m,): their light
    """
    if not unseen.any():
        return cost
    stands = np.isinf(cost) & np.isfinite(off)
    more = mass[:, None] > FIRST_SIGHT.outdone * mass  # the first has more than the second
    nearer = off[:, :, None] < off[:, None, :]
    outdone = (stands[:, :, None] & nearer & more).any(axis=1)
    return np.where(unseen[:, None] & outdone, np.inf, cost)
