"""Which of the pairs that might be joined are beyond doubt: by their lead over the best other way.

The other way gives a part of the pair to a rival, and what is then left, on both sides, to the best that it could not
have otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from heapq import heapify, heappop, heappush
from math import copysign, sqrt
from typing import NamedTuple

CHANCE = 3.0
"""Standard deviations of the noise in a difference of likelihoods that is taken for chance."""

Pair = tuple[int, int]


class Worth(NamedTuple):
    """What joining two groups is worth, nats: by their lines of sight, over n misses, and by the motion."""

    sights: float
    motion: float
    n: int


NOTHING = Worth(0.0, 0.0, 0)
NONE, UNJUDGED = -1, -2
"""No rival; a pair that is not judged yet."""


class Clear(NamedTuple):
    """A pair of groups that are to be joined, likelier by `lead` nats than if `rival` (NONE) took a part of it."""

    lead: float
    pair: Pair
    rival: int


class Choices:
    """Which pairs of groups are to be joined: those whose lead over the best other way is above the margin.

    partners   what each group gains something from, and what
    excludes   whether two groups cannot both be of one target
    margin     nats
    """

    def __init__(
        self,
        partners: Callable[[int], Mapping[int, Worth]],
        excludes: Callable[[int, int], bool],
        margin: float,
    ) -> None:
        self.partners, self.excludes, self.margin = partners, excludes, margin
        self._ranked: dict[int, list[tuple[int, Worth]]] = {}

    def clear(self, worth: Mapping[Pair, Worth]) -> list[Clear]:
        """All pairs of these that are clear, the clearest first."""
        found = (self._judged(pair, own) for pair, own in worth.items())
        return sorted((one for one in found if one.lead > self.margin), reverse=True)

    def clear_apart(self, worth: Mapping[Pair, Worth]) -> list[Clear]:
        """The clearest pairs of which no two share a group: only those are judged that may be among them."""
        # no lead is above the pair's worth
        waiting = [(-_total(w), (-g, -h), -UNJUDGED) for (g, h), w in worth.items()]
        heapify(waiting)
        touched: set[int] = set()
        out = []
        while waiting:
            less, (a, b), rival = heappop(waiting)
            g, h = pair = -a, -b
            if g in touched or h in touched:
                continue
            if -rival == UNJUDGED:
                lead, _, rival = self._judged(pair, worth[pair])
                if lead > self.margin:
                    heappush(waiting, (-lead, (a, b), -rival))
            else:
                touched |= {g, h}
                out.append(Clear(-less, pair, -rival))
        return out

    def _judged(self, pair: Pair, value: Worth) -> Clear:
        lead, rival = _total(value), NONE
        for one, other in (pair, (pair[1], pair[0])):
            for k, w in self.partners(one).items():
                if lead <= self.margin:
                    break
                if k != other and self.excludes(k, other):
                    less = _lead((value, self._best(k, pair, one)), (w, self._best(other, (one, k), one)))
                    lead, rival = (less, k) if less < lead else (lead, rival)
        return Clear(lead, pair, rival)

    def _best(self, g: int, but: Pair, beside: int) -> Worth:
        """The best partner of g that it could not have beside another one."""
        ranked = self._ranked.get(g)
        if ranked is None:
            ranked = self._ranked[g] = sorted(self.partners(g).items(), key=lambda item: -_total(item[1]))
        for k, w in ranked:
            if k not in but and self.excludes(k, beside):
                return w
        return NOTHING


def _total(worth: Worth) -> float:
    return worth.sights + worth.motion


def _lead(ours: tuple[Worth, Worth], theirs: tuple[Worth, Worth]) -> float:
    """Nats by which two pairs are likelier than two others.

    Where both fit, noise alone makes the sums of n misses' chi^2 / 2 differ by sqrt(n / 2): so much says nothing.
    """
    sights = ours[0].sights + ours[1].sights - theirs[0].sights - theirs[1].sights
    noise = CHANCE * sqrt((ours[0].n + ours[1].n + theirs[0].n + theirs[1].n) / 2)
    motion = ours[0].motion + ours[1].motion - theirs[0].motion - theirs[1].motion
    return copysign(max(abs(sights) - noise, 0.0), sights) + motion
