"""Tracklets joined to groups, each of one target, as far as lines of sight decide it beyond doubt.

A group holds tracklets of any camera; two of one camera never at one moment. It is worth the sum of its pairs'
values. Groups are joined, those with the clearest margin first, while what is gained is larger by `MARGIN` than what
any other choice would gain that excludes it; what remains contested stays apart, for the motion to decide.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Ints
from vidtrack.association.choices import NONE, Choices, Worth
from vidtrack.association.pairs import LOSS, Pairs
from vidtrack.association.tracklets import Tracklets

MARGIN = float(np.log(1000.0))
"""Nats by which a choice must be likelier than the next one."""
TOUCHES = 2
"""Moments that two tracklets may overlap in without fitting, at a loss; with more they contradict each other."""

NAMED = 20.0
"""# ASSUME: nats for one target where the user's start boxes give two tracklets one name, and against it where they
give two: names are exchanged by mistake now and then, so that lines of sight can refute them."""

Span = tuple[int, int, int]
"""First and last moment of a tracklet, and its node."""


AGAINST = Worth(-np.inf, 0.0, 0)


class Tie(NamedTuple):
    """How surely a tracklet belongs to the rest of its group, at its least sure join."""

    lead: float  # nats by which the join is likelier than any other choice
    fellow: int  # node of the other part that is nearest in time
    rival: int  # a node of what it would be joined with in the next best way; -1 where there is none


class Nodes(NamedTuple):
    """The tracklets of all cameras, with one number each."""

    camera: list[int]
    first: list[int]
    last: list[int]
    begin: Ints  # (n_cameras + 1,) number of each camera's first tracklet
    name: list[str]  # that the user's start box gives it; empty: none


def nodes_of(tracklets: Sequence[Tracklets], names: Sequence[Sequence[str]] | None = None) -> Nodes:
    """Give every tracklet a number, camera by camera."""
    begin = np.concatenate([[0], np.cumsum([t.n for t in tracklets])]).astype(np.intp)
    camera = np.repeat(np.arange(len(tracklets)), np.diff(begin)).tolist()
    return Nodes(
        camera,
        np.concatenate([t.first for t in tracklets]).tolist() if tracklets else [],
        np.concatenate([t.last for t in tracklets]).tolist() if tracklets else [],
        begin,
        [name for own in names for name in own] if names is not None else [""] * len(camera),
    )


class Groups:
    """A partition of the nodes; `value` is what joining two groups is worth."""

    def __init__(self, nodes: Nodes, n_cameras: int) -> None:
        n = len(nodes.camera)
        self.nodes, self.n_cameras = nodes, n_cameras
        self.root = list(range(n))
        self.members: dict[int, list[int]] = {i: [i] for i in range(n)}
        self.spans: dict[int, list[list[Span]]] = {}
        self.span: dict[int, tuple[int, int]] = {i: (nodes.first[i], nodes.last[i]) for i in range(n)}
        self.lead: dict[int, float] = dict.fromkeys(range(n), np.inf)
        self.pair: dict[int, int] = {}  # by `_key` of two nodes that fit at some moment: which of the next two lists
        self._worth: list[float] = []
        self._common: list[int] = []
        self.joins = [0] * n  # how often a group has grown
        self.names = [{name} - {""} for name in nodes.name]
        self.tie: dict[int, Tie] = {}
        self._known: list[dict[int, Worth]] = [{} for _ in range(n)]  # what joining is worth, while neither changes
        self.kin: dict[int, set[int]] = {
            i: set() for i in range(n)
        }  # groups with a tracklet that fits one of a group's
        self._foes: dict[int, set[int]] = {i: set() for i in range(n)}  # those that contradict it, as far as known
        self._partners: dict[int, dict[int, Worth]] = {}
        self._stale: dict[int, set[int]] = {}  # what of a group's partners is to be judged anew
        for i in range(n):
            own: list[list[Span]] = [[] for _ in range(n_cameras)]
            own[nodes.camera[i]].append((nodes.first[i], nodes.last[i], i))
            self.spans[i] = own

    def add(self, i: int, j: int, pairs: Pairs) -> None:
        """Take in the pairs of cameras i and j."""
        begin = self.nodes.begin
        a, b = pairs.a + begin[i], pairs.b + begin[j]
        known = len(self._worth)
        key = np.minimum(a, b) * len(self.root) + np.maximum(a, b)
        self.pair.update(zip(key.tolist(), range(known, known + key.size), strict=True))
        self._worth += pairs.value.tolist()
        self._common += pairs.n.tolist()
        good = pairs.value > 0
        for one, other in zip(a[good].tolist(), b[good].tolist(), strict=True):
            self.kin[one].add(other)
            self.kin[other].add(one)

    def value(self, g: int, h: int) -> float:
        """Nats that joining two groups is worth; -inf where they contradict each other."""
        return (self._known[g].get(h) or self._weighed(g, h)).sights

    def sights(self, g: int, h: int) -> tuple[float, int]:
        """The same, and the number of misses that it is the sum over."""
        worth = self._known[g].get(h) or self._weighed(g, h)
        return worth.sights, worth.n

    def _weighed(self, g: int, h: int) -> Worth:
        """What joining two groups is worth by lines of sight, to be remembered until one of them changes."""
        if g > h:
            g, h = h, g
        if h in self._foes[g]:  # a contradiction stays, whatever joins either
            return AGAINST
        (a, b), (c, d) = self.span[g], self.span[h]
        if a > d or c > b:
            value, n = self._by_name(g, h), 0
        elif len(self.members[g]) == 1 == len(self.members[h]):
            value, n = self._of_two(g, h)
        else:
            value, n = self._summed(g, h)
        if value == -np.inf:
            self._foes[g].add(h)
            self._foes[h].add(g)
            return AGAINST
        worth = self._known[g][h] = self._known[h][g] = Worth(value, 0.0, n)
        return worth

    def _excludes(self, g: int, h: int) -> bool:
        """Whether two groups cannot be one target, or are unlikely to be."""
        return h in self._foes[g] or (self._known[g].get(h) or self._weighed(g, h)).sights < 0

    def _forget(self, g: int) -> None:
        """A group has changed."""
        for h in self._known[g]:
            del self._known[h][g]
        self._known[g] = {}

    def _of_two(self, g: int, h: int) -> tuple[float, int]:
        """As `_summed`, of groups of one tracklet each, that overlap."""
        one, other = self.members[g][0], self.members[h][0]
        if self.nodes.camera[one] == self.nodes.camera[other]:
            return -np.inf, 0
        fit = self.pair.get(self._key(one, other))
        if fit is not None:
            return self._worth[fit] + self._by_name(g, h), self._common[fit]
        (a, b), (c, d) = self.span[g], self.span[h]
        n = min(b, d) - max(a, c) + 1
        return (-np.inf, 0) if n > TOUCHES else (-LOSS * n + self._by_name(g, h), n)

    def _key(self, one: int, other: int) -> int:
        return one * len(self.root) + other if one < other else other * len(self.root) + one

    def _summed(self, g: int, h: int) -> tuple[float, int]:
        if len(self.members[g]) < len(self.members[h]):
            g, h = h, g
        total, count, nodes, pair = 0.0, 0, len(self.root), self.pair
        seen = [(other, theirs, len(theirs)) for other, theirs in enumerate(self.spans[g]) if theirs]
        for camera, spans in enumerate(self.spans[h]):
            for first, last, node in spans:
                begin = (first,)
                for other, theirs, most in seen:
                    k = bisect_left(theirs, begin)
                    if k and theirs[k - 1][1] >= first:
                        k -= 1
                    while k < most:
                        low, high, other_node = theirs[k]
                        if low > last:
                            break
                        k += 1
                        if other == camera:
                            return -np.inf, 0
                        fit = pair.get(node * nodes + other_node if node < other_node else other_node * nodes + node)
                        if fit is not None:
                            total += self._worth[fit]
                            count += self._common[fit]
                            continue
                        n = (high if high < last else last) - (low if low > first else first) + 1
                        if n > TOUCHES:
                            return -np.inf, 0
                        total += -LOSS * n
                        count += n
        return total + self._by_name(g, h), count

    def _by_name(self, g: int, h: int) -> float:
        """Nats that the names of two groups say for their being one target."""
        if not self.names[g] or not self.names[h]:
            return 0.0
        return -NAMED if self.names[g].isdisjoint(self.names[h]) else NAMED

    def give(self, names: Mapping[int, str]) -> None:
        """Name groups, and join those of one name that can be one target."""
        for g, name in names.items():
            self.names[g] = self.names[g] | {name}
            self.joins[g] += 1
            self._forget(g)
        for name in sorted(set(names.values())):
            own = sorted({self.root[g] for g in names if names[g] == name}, key=lambda g: self.span[g])
            for g in own[1:]:
                first = self.root[own[0]]
                value = self.value(first, g)
                if value > MARGIN:
                    self.join(first, g, value)

    def join(self, g: int, h: int, lead: float = np.inf, rival: int = NONE) -> int:
        """Join two groups, likelier by `lead` nats than if `rival` took one; returns the one that holds both."""
        if len(self.members[g]) < len(self.members[h]):
            g, h = h, g
        both = self._of_both(g, h)
        for node in self.members[h]:
            if node not in self.tie or lead < self.tie[node].lead:
                self.tie[node] = Tie(lead, self._nearest(g, node), rival)
        self.names[g] = self.names[g] | self.names[h]
        self.lead[g] = min(lead, self.lead[g], self.lead.pop(h))
        (a, b), (c, d) = self.span[g], self.span.pop(h)
        self.span[g] = (min(a, c), max(b, d))
        for node in self.members[h]:
            self.root[node] = g
        for camera, spans in enumerate(self.spans.pop(h)):
            for span in spans:
                insort(self.spans[g][camera], span)
        self.members[g] += self.members.pop(h)
        self.joins[g] += 1
        self._forget(g)
        self._forget(h)
        self._hand_over(g, h)
        self._remember(g, both)
        return g

    def _of_both(self, g: int, h: int) -> dict[int, Worth]:
        """What joining the union of two groups with others is worth: the sum of what its parts are, where known."""
        if self.names[g] and self.names[h]:  # a name counts once
            return {}
        out = {}
        for one, other in ((g, h), (h, g)):
            known, (first, last) = self._known[other], self.span[other]
            for k, worth in self._known[one].items():
                if k == other:
                    continue
                theirs = known.get(k)
                if theirs is not None:
                    if one == g:
                        out[k] = Worth(worth.sights + theirs.sights, 0.0, worth.n + theirs.n)
                    continue
                a, b = self.span[k]
                if (a > last or first > b) and not (self.names[other] and self.names[k]):  # that part says nothing
                    out[k] = worth
        return out

    def _remember(self, g: int, worths: Mapping[int, Worth]) -> None:
        foes = self._foes[g]
        known = self._known[g] = {k: worth for k, worth in worths.items() if k not in foes}
        for k, worth in known.items():
            self._known[k][g] = worth

    def _hand_over(self, g: int, h: int) -> None:
        """What fits or contradicts h does so with g, which holds it by now."""
        for others in (self.kin, self._foes):
            own = others.pop(h)
            others[g] |= own
            for k in own:
                if k in others:
                    others[k].discard(h)
                    others[k].add(g)
        self.kin[g] -= {g, h}
        for k in (g, h):
            self._partners.pop(k, None)
            self._stale.pop(k, None)
        for k in self.kin[g]:
            gains = self._partners.get(k)
            if gains is not None:
                gains.pop(g, None)
                gains.pop(h, None)
                self._stale.setdefault(k, set()).add(g)

    def _nearest(self, g: int, node: int) -> int:
        """The member of a group that is nearest in time to a node."""
        first, last = self.nodes.first[node], self.nodes.last[node]
        best, least = -1, np.inf
        for spans in self.spans[g]:
            k = bisect_left(spans, (first, -1, -1))
            for low, high, member in spans[max(k - 1, 0) : k + 1]:
                gap = max(low, first) - min(high, last)
                if gap < least:
                    best, least = member, gap
        return best

    def cameras(self, g: int) -> int:
        """How many cameras a group has tracklets of."""
        return sum(bool(s) for s in self.spans[g])

    def partners(self, g: int) -> dict[int, Worth]:
        """Groups that a group gains from by lines of sight, and what."""
        found = self._partners.get(g)
        several: set[int] = self.kin[g]
        if found is None:
            found = self._partners[g] = {}
        elif g in self._stale:
            several = self._stale.pop(g) & several
        else:
            return found
        known, foes = self._known[g], self._foes[g]
        for h in several:
            if h not in foes:
                worth = known.get(h) or self._weighed(g, h)
                if worth.sights > 0:
                    found[h] = worth
        return found

    def join_the_clear(self, margin: float = MARGIN) -> None:
        """Join groups round by round while any choice is clear."""
        active = set(self.members)
        while True:
            worth = {}
            for g in active:
                for h, w in self.partners(g).items():
                    if g < h:
                        worth[g, h] = w
                    elif h not in active:
                        worth[h, g] = w
            clear = Choices(self.partners, self._excludes, margin).clear_apart(worth)
            changed = {self.join(g, h, lead, rival) for lead, (g, h), rival in clear}
            if not changed:
                return
            active = changed
            for _ in range(2):  # what a choice depends on
                active = active.union(*(self.kin[g] for g in active))


def labels(groups: Groups) -> Ints:
    """The group (n_nodes,) of each node, numbered from 0 in order of their first node."""
    return np.unique(np.array(groups.root, np.intp), return_inverse=True)[1].astype(np.intp)
