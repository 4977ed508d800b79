"""Which of the pairs that might be joined are beyond doubt: by their lead over the best other way.

The other way gives a part of the pair to a rival, and what is then left, on both sides, to the best that it could not
have otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from heapq import heappop, heappush
from math import copysign, inf, sqrt
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
NONE = -1
"""No rival."""


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
        total = ((w.sights + w.motion, pair) for pair, w in worth.items())
        waiting = sorted(((value, pair) for value, pair in total if value > self.margin), reverse=True)
        judged: list[tuple[float, Pair, int]] = []
        touched: set[int] = set()
        out = []
        for most, pair in [*waiting, (-inf, (NONE, NONE))]:
            # those that are clear by more than what is not judged yet may be worth; of equal ones the higher numbers
            while judged and (-judged[0][0], (-judged[0][1][0], -judged[0][1][1])) > (most, pair):
                less, (a, b), rival = heappop(judged)
                if -a not in touched and -b not in touched:
                    touched |= {-a, -b}
                    out.append(Clear(-less, (-a, -b), rival))
            if touched.isdisjoint(pair) and most > -inf:
                lead, _, rival = self._judged(pair, worth[pair])
                if lead > self.margin:
                    heappush(judged, (-lead, (-pair[0], -pair[1]), rival))
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
