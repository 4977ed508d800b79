"""Groups joined where lines of sight leave it open: by the motion as well, in space and in each picture.

A pair of groups is worth the evidence of its lines of sight and that of the motion at the seams of its joint course.
Pairs are joined, the clearest first, while the next best way to give their parts to others is less likely by `MARGIN`.
"""

from __future__ import annotations

import itertools
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations
from math import hypot

import numpy as np

from vidtrack.arrays import Ints
from vidtrack.association.choices import Choices, Pair, Worth
from vidtrack.association.continuity import BOUNCES, UNKNOWN, Evidence, Motion
from vidtrack.association.courses import (
    AROUND,
    Course,
    Rows,
    courses,
    end_to_end,
    fewest_of,
    longest_gap,
    motion_of,
    seam_evidence,
)
from vidtrack.association.groups import MARGIN, TOUCHES, Groups
from vidtrack.geometry.camera import Camera

Point = tuple[float, float]
Local = tuple[tuple[int, ...], tuple[int, ...]]

REACHES = (8, 30, 100, 400)
"""Moments that a gap may last to be bridged by the motion: short ones first, so that few are left for long ones."""


FARTHEST = 1 << 40
LASTS = 10
"""Moments that a course has, at least, to be taken for a part of a target."""
FASTER = 2.0
"""Times the fastest speed and the sharpest bend seen in a picture, that a target may have while it is not seen."""


def _information(evidence: Evidence) -> float:
    return evidence.information


class Bridges:
    """Worth of joining groups, kept while neither changes."""

    def __init__(self, cameras: Sequence[Camera | None], rows: Rows, groups: Groups) -> None:
        self.cameras, self.rows, self.groups = cameras, rows, groups
        self.fewest = fewest_of(cameras)
        self.edges = np.searchsorted(rows.node, np.arange(len(groups.root) + 1))
        self.known: dict[Local, float] = {}
        self._made: dict[int, tuple[int, Course]] = {}
        self._reach: dict[Pair, tuple[int, int, bool]] = {}
        self.first, self.last = groups.nodes.first, groups.nodes.last
        self.farthest = REACHES[0]
        self.heads, self.tails = self._ends(0), self._ends(-1)
        self.pictures = [self._pictured(c) for c in range(len(cameras))]
        self.space: Motion | None = None

    def _pictured(self, camera: int) -> Motion:
        """How targets move in one picture."""
        begin = self.groups.nodes.begin
        own = slice(int(self.edges[begin[camera]]), int(self.edges[begin[camera + 1]]))
        return motion_of(self._seen(own, self.rows.node[own]))

    def _seen(self, row: Ints | slice, source: Ints) -> Course:
        return Course(self.rows.moment[row], self.rows.b[row], source)

    def rows_of_nodes(self, nodes: Sequence[int]) -> Ints:
        """Rows of tracklets."""
        return np.concatenate([np.arange(self.edges[n], self.edges[n + 1]) for n in nodes])

    def located(self) -> list[int]:
        """Groups that enough cameras show."""
        return [g for g in self.groups.members if self.groups.cameras(g) >= self.fewest]

    def group_courses(self) -> dict[int, Course]:
        """The course of every group that enough cameras show."""
        several, joins = self.located(), self.groups.joins
        new = [g for g in several if self._made.get(g, (-1, None))[0] != joins[g]]
        chosen = [self.rows_of_nodes(self.groups.members[g]) for g in new]
        made = courses(self.cameras, self.rows, [(r, np.ones(len(r), np.intp)) for r in chosen])
        self._made.update({g: (joins[g], course) for g, course in zip(new, made, strict=True)})
        return {g: self._made[g][1] for g in several}

    def learn(self) -> None:
        """Measure how targets move in space, from the groups as they are."""
        several = [c for c in self.group_courses().values() if len(c.moment)]
        dimension = 3 if len(self.cameras) > 1 else 2
        self.space = motion_of(end_to_end(several)) if several else Motion([np.zeros((0, dimension))])

    def worths(self) -> dict[Pair, Worth]:
        """What joining is worth, nats, for all pairs of groups that fit or that a short gap parts."""
        pairs = [p for p in self._candidates() if self._reachable(*p)]
        sights = {p: self.groups.sights(*p) for p in pairs}
        out: dict[Pair, Worth] = {}
        fresh: list[tuple[Pair, Local, tuple[Ints, Ints]]] = []
        for pair in pairs:
            if np.isfinite(sights[pair][0]):
                local, window = self._local(pair)
                if local not in self.known:
                    fresh.append((pair, local, self._joint(local, window)))
                else:
                    out[pair] = Worth(sights[pair][0], self.known[local], sights[pair][1])
        made = courses(self.cameras, self.rows, [rows for _, _, rows in fresh])
        for (pair, local, rows), course in zip(fresh, made, strict=True):
            moved = self._moved(course, rows)
            self.known[local] = moved
            out[pair] = Worth(sights[pair][0], moved, sights[pair][1])
        return out

    def _reachable(self, g: int, h: int) -> bool:
        """Whether one group can become the other in every picture, by FASTER times the run's speeds and bends there."""
        state = self.groups.joins[g], self.groups.joins[h]
        known = self._reach.get((g, h))
        if known is None or known[:2] != state:
            known = self._reach[g, h] = (*state, self._can_become(g, h))
        return known[2]

    def _can_become(self, g: int, h: int) -> bool:
        groups = self.groups
        if len(groups.members[g]) > len(groups.members[h]):
            g, h = h, g
        (a, b), (c, d) = groups.span[g], groups.span[h]
        whole = 0 < max(a, c) - min(b, d) <= BOUNCES  # other cameras saw it when this one did not
        for camera, (few, many) in enumerate(zip(groups.spans[g], groups.spans[h], strict=True)):
            if not many:
                continue
            for i, (first, last, node) in enumerate(few):
                k = bisect_left(many, (first, -1, -1))
                before = k > 0 and many[k - 1][1] < first and (not i or few[i - 1][0] < many[k - 1][0])
                after = k < len(many) and many[k][0] > last and (i + 1 == len(few) or few[i + 1][0] > many[k][0])
                if before and not self._reached(camera, many[k - 1][2], node, whole):
                    return False
                if after and not self._reached(camera, node, many[k][2], whole):
                    return False
        return True

    def _reached(self, camera: int, one: int, other: int, whole: bool = False) -> bool:
        """Whether a tracklet can go on as another one of the same picture, that begins after its end.

        whole  nothing is missing between the groups that they are of: it may have bounced, however long its own gap is
        """
        motion = self.pictures[camera]
        (x, y), v, sd = self.tails[one]
        (X, Y), w, _ = self.heads[other]
        gap = self.first[other] - self.last[one]
        if hypot(X - x, Y - y) > FASTER * motion.fastest * gap + 10 * sd:
            return False
        if whole or gap <= BOUNCES:  # it may have bounced: its place goes on, its velocity need not
            return True
        bend = FASTER * motion.sharpest * gap * (gap + 3) / 2 + 10 * sd * (1 + gap)
        return (v is None or hypot(X - x - gap * v[0], Y - y - gap * v[1]) <= bend) and (
            w is None or hypot(X - x - gap * w[0], Y - y - gap * w[1]) <= bend
        )

    def _ends(self, which: int) -> list[tuple[Point, Point | None, float]]:
        """Place, velocity a moment and sd, px, of each tracklet at its first (0) or last (-1) sample."""
        n = np.diff(self.edges)
        at = self.edges[:-1] if which == 0 else self.edges[1:] - 1
        low = at if which == 0 else at - 2
        first, last = (np.clip(i, 0, len(self.rows.node) - 1) for i in (low, low + 2))
        time = self.rows.moment[last] - self.rows.moment[first]
        v = (self.rows.b[last] - self.rows.b[first]) / np.where(n < 3, 1, time)[:, None]
        b, sd = self.rows.b[at], self.rows.sd[at].max(axis=-1)
        known = (n >= 3).tolist()
        return [
            ((x, y), (vx, vy) if k else None, s)
            for (x, y), (vx, vy), s, k in zip(b.tolist(), v.tolist(), sd.tolist(), known, strict=True)
        ]

    def _moved(self, course: Course, rows: tuple[Ints, Ints]) -> float:
        """What the motion contributes, nats: in space or in a picture, whichever has more such gaps.

        A camera that goes on seeing what the others lost bridges a gap that is more than twice as long in space.
        """
        located = self.space is not None and len(course.moment)
        gap = longest_gap(course.moment, course.source) if located else 0
        known = [seam_evidence(course, self.space)] if gap and self.space is not None else []
        return max([*known, *self._in_pictures(*rows, gap / 2 or FARTHEST)], key=_information, default=UNKNOWN).nats

    def _in_pictures(self, row: Ints, part: Ints, shorter: float) -> Iterator[Evidence]:
        """What the motion says in each picture where the gap is shorter than so many moments."""
        for camera, motion in enumerate(self.pictures):
            own = self.rows.camera[row] == camera
            mine, parts = row[own], part[own]
            order = np.argsort(self.rows.moment[mine], kind="stable")
            mine, parts = mine[order], parts[order]
            if 0 < longest_gap(self.rows.moment[mine], parts) < shorter:
                yield seam_evidence(self._seen(mine, parts), motion)

    def _local(self, pair: Pair) -> tuple[Local, tuple[int, int]]:
        """The tracklets of two groups about where one passes into the other, and from when to when that is."""
        (a, b), (c, d) = (self.groups.span[g] for g in pair)
        if max(a, c) > min(b, d):  # one after the other
            low, high = min(b, d), max(a, c)
        else:
            low, high = (a, b) if b - a <= d - c else (c, d)
        low, high = low - AROUND, high + AROUND
        one, other = (
            tuple(n for n in self.groups.members[g] if self.first[n] <= high and self.last[n] >= low) for g in pair
        )
        return (one, other), (low, high)

    def _joint(self, local: Local, window: tuple[int, int]) -> tuple[Ints, Ints]:
        """The rows of those tracklets at that time, and which of the two groups each belongs to."""
        rows = []
        for nodes in local:
            row = self.rows_of_nodes(nodes) if nodes else np.zeros(0, np.intp)
            rows.append(row[(self.rows.moment[row] >= window[0]) & (self.rows.moment[row] <= window[1])])
        return np.concatenate(rows), np.repeat([1, 2], [len(r) for r in rows])

    def _candidates(self) -> list[Pair]:
        """Pairs of groups that fit, or one of which ends shortly before the other begins, altogether or in a camera."""
        groups = self.groups
        out = {(min(g, h), max(g, h)) for g in groups.members for h in groups.kin[g]}
        begins = sorted((s[0], g) for g, s in groups.span.items())
        first = [b for b, _ in begins]
        for g, (_, last) in groups.span.items():
            i, j = bisect_left(first, last + 1), bisect_left(first, last + self.farthest + 1)
            out |= {(min(g, h), max(g, h)) for _, h in begins[i:j]}
        if self.farthest == FARTHEST:  # courses that take turns as well
            several = sorted(self.located())
            out |= set(combinations(several, 2))
        for camera in range(len(self.cameras)):
            out |= self._in_gaps(camera)
        return sorted(out)

    def _in_gaps(self, camera: int) -> set[Pair]:
        """Groups of this camera alone with those that have a short enough gap there in which they lie."""
        groups = self.groups
        single = sorted(
            (*groups.span[g], g) for g in groups.members if groups.cameras(g) == 1 and groups.spans[g][camera]
        )
        first = [s[0] for s in single]
        out: set[Pair] = set()
        for g, spans in groups.spans.items():
            own, whole = spans[camera], groups.span[g]
            if groups.cameras(g) < self.fewest:
                continue
            edges = [(whole[0] - 1, whole[0] - 1), *((a, b) for a, b, _ in own), (whole[1] + 1, whole[1] + 1)]
            for (_, before), (after, _) in itertools.pairwise(edges):
                for a, b, h in single[bisect_left(first, before + 1) : bisect_left(first, after)]:
                    if b < after and (a - before <= self.farthest or after - b <= self.farthest):
                        out.add((g, h) if g < h else (h, g))
        return out

    def join_the_clear(self, margin: float = MARGIN) -> None:
        """Join pairs round by round while any is clear, over longer and longer gaps."""
        for self.farthest in REACHES:
            while self._join_some(self.worths(), margin, len(self.groups.root)):
                pass

    def join_to(self, targets: int, bonus: float, margin: float = MARGIN) -> None:
        """Join courses one after another while there are more than so many targets.

        bonus   nats for one target throughout rather than one that disappears and another one that appears; the same
                for all pairs, as it does not say which continues which; none for what one camera alone shows, which
                does not count as a target
        """
        self.farthest = FARTHEST
        while True:
            several = set(self.located())
            surplus = len(several) - targets
            worth = {
                p: w._replace(motion=w.motion + bonus * (several.issuperset(p) and self._lasts(*p, w.n)))
                for p, w in self.worths().items()
            }
            if surplus <= 0 or not self._join_some(worth, margin, surplus, several):
                return

    def _join_some(self, worth: dict[Pair, Worth], margin: float, most: int, only: set[int] | None = None) -> bool:
        """Join the clear pairs, each group in one of them, at most so many; returns whether there was any."""
        touched: set[int] = set()
        gain = {p: w for p, w in worth.items() if w.sights + w.motion > 0}
        partners: dict[int, dict[int, Worth]] = defaultdict(dict)
        for (g, h), w in gain.items():
            partners[g][h] = partners[h][g] = w
        clear = Choices(partners.__getitem__, lambda g, h: self.groups.value(g, h) < 0, margin).clear(gain)
        if only is not None:  # the nearest in time first: none is passed over
            clear = [one for one in clear if only.issuperset(one.pair)]
            nearest = min((self._gap(*one.pair) for one in clear), default=0)
            clear = [one for one in clear if self._gap(*one.pair) <= max(REACHES[0], 2 * nearest)]
        for lead, (g, h), rival in clear:
            if g not in touched and h not in touched and len(touched) < 2 * most:
                touched |= {g, h}
                self.groups.join(g, h, lead, rival)
        return bool(touched)

    def _gap(self, g: int, h: int) -> int:
        """Moments from the end of one group to the begin of the other, or that they overlap in."""
        (a, b), (c, d) = self.groups.span[g], self.groups.span[h]
        return abs(max(a, c) - min(b, d))

    def _lasts(self, g: int, h: int, common: int) -> bool:
        """Whether two groups share hardly any moments, and neither is too short to be distinguished from chance.

        One that begins the moment after the other ended need not be long.
        """
        (a, b), (c, d) = self.groups.span[g], self.groups.span[h]
        after = 0 < max(a, c) - min(b, d) <= BOUNCES
        return common <= TOUCHES and (after or min(b - a, d - c) >= LASTS)
