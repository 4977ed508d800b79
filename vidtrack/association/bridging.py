"""Groups joined where lines of sight leave it open: by the motion as well, in space and in each picture.

A pair of groups is worth what its lines of sight tell and what the motion tells at the seams of its joint course. Pairs
are joined, the clearest first, while the next best way to give their parts to others is less likely by `MARGIN`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Ints
from vidtrack.association.continuity import Motion
from vidtrack.association.courses import AROUND, Course, Rows, courses, motion_of, seam_evidence
from vidtrack.association.groups import MARGIN, Groups
from vidtrack.geometry.camera import Camera

Pair = tuple[int, int]

REACHES = (8, 30, 100, 400)
"""Moments that a gap may last to be bridged by the motion: short ones first, so that few are left for long ones."""


FASTER = 2.0
"""Times the fastest speed seen in a picture, that a target may have while it is not seen."""


class Bridges:
    """Worth of joining groups, remembered while neither changes."""

    def __init__(self, cameras: Sequence[Camera], rows: Rows, groups: Groups) -> None:
        self.cameras, self.rows, self.groups = cameras, rows, groups
        self.order = np.lexsort((rows.moment, rows.node))
        self.edges = np.searchsorted(rows.node[self.order], np.arange(len(groups.root) + 1))
        self.known: dict[tuple[Pair, int, int], float] = {}
        self.first, self.last = groups.nodes.first, groups.nodes.last
        self.farthest = REACHES[0]
        self.pictures = [self._pictured(c) for c in range(len(cameras))]
        self.space: Motion | None = None

    def _pictured(self, camera: int) -> Motion:
        """How targets move in one picture."""
        begin = self.groups.nodes.begin
        own = [self.rows_of_nodes([node]) for node in range(int(begin[camera]), int(begin[camera + 1]))]
        return motion_of([self._seen(r) for r in own], 2)

    def _seen(self, row: Ints, source: Ints | None = None) -> Course:
        return Course(
            self.rows.moment[row], self.rows.b[row], np.ones(len(row), np.intp) if source is None else source
        )

    def rows_of_nodes(self, nodes: Sequence[int]) -> Ints:
        """Rows of tracklets."""
        return np.concatenate([self.order[self.edges[n] : self.edges[n + 1]] for n in nodes])

    def group_courses(self) -> dict[int, Course]:
        """The course of every group that two cameras see."""
        several = [g for g, spans in self.groups.spans.items() if sum(bool(s) for s in spans) >= 2]
        chosen = [self.rows_of_nodes(self.groups.members[g]) for g in several]
        made = courses(self.cameras, self.rows, [(r, np.ones(len(r), np.intp)) for r in chosen])
        return dict(zip(several, made, strict=True))

    def learn(self) -> None:
        """Measure how targets move in space, from the groups as they are."""
        self.space = motion_of([c for c in self.group_courses().values() if len(c.moment)], 3)

    def worths(self) -> dict[Pair, float]:
        """What joining is worth, nats, for all pairs of groups that fit or that a short gap parts."""
        pairs = self._candidates()
        version = {g: len(m) for g, m in self.groups.members.items()}
        fresh = [p for p in pairs if (p, version[p[0]], version[p[1]]) not in self.known]
        sights = {p: self.groups.value(*p) if self._reachable(*p) else -np.inf for p in fresh}
        real = [p for p in fresh if np.isfinite(sights[p])]
        chosen = [self._joint(p) for p in real]
        made = courses(self.cameras, self.rows, chosen)
        for pair in fresh:
            self.known[pair, version[pair[0]], version[pair[1]]] = -np.inf
        for pair, rows, course in zip(real, chosen, made, strict=True):
            moved, seams = 0.0, 0
            if self.space is not None and len(course.moment):
                moved, seams = seam_evidence(course, self.space)
            if not seams:
                moved = self._in_pictures(*rows)
            self.known[pair, version[pair[0]], version[pair[1]]] = sights[pair] + moved
        return {p: self.known[p, version[p[0]], version[p[1]]] for p in pairs}

    def _reachable(self, g: int, h: int) -> bool:
        """Whether one group can become the other in every picture, at FASTER times the run's fastest speed there."""
        (a, b), (c, d) = self.groups.span[g], self.groups.span[h]
        if max(a, c) <= min(b, d):
            return True
        before, after = (g, h) if b < c else (h, g)
        for camera, motion in enumerate(self.pictures):
            one, other = self.groups.spans[before][camera], self.groups.spans[after][camera]
            if one and other:
                last, first = one[-1], other[0]
                i, j = self.order[self.edges[last[2] + 1] - 1], self.order[self.edges[first[2]]]
                apart = self.rows.b[i] - self.rows.b[j]
                reach = FASTER * motion.fastest * (first[0] - last[1]) + 10 * float(self.rows.sd[i].max())
                if float(np.hypot(*apart)) > reach:
                    return False
        return True

    def _in_pictures(self, row: Ints, part: Ints) -> float:
        total = 0.0
        for camera, motion in enumerate(self.pictures):
            own = self.rows.camera[row] == camera
            if own.any():
                mine, parts = row[own], part[own]
                order = np.argsort(self.rows.moment[mine], kind="stable")
                total += seam_evidence(self._seen(mine[order], parts[order]), motion)[0]
        return total

    def _joint(self, pair: Pair) -> tuple[Ints, Ints]:
        """The rows of two groups about where one passes into the other, and which of them each belongs to."""
        (a, b), (c, d) = (self.groups.span[g] for g in pair)
        if max(a, c) > min(b, d):  # one after the other
            low, high = min(b, d) - AROUND, max(a, c) + AROUND
        else:
            low, high = ((a, b) if b - a <= d - c else (c, d))
            low, high = low - AROUND, high + AROUND
        rows, parts = [], []
        for k, g in enumerate(pair):
            nodes = [
                n for n in self.groups.members[g] if self.first[n] <= high and self.last[n] >= low
            ]
            row = self.rows_of_nodes(nodes) if nodes else np.zeros(0, np.intp)
            row = row[(self.rows.moment[row] >= low) & (self.rows.moment[row] <= high)]
            rows.append(row)
            parts.append(np.full(len(row), k + 1))
        return np.concatenate(rows), np.concatenate(parts)

    def _candidates(self) -> list[Pair]:
        """Pairs of groups that fit, or one of which ends shortly before the other begins, altogether or in a camera."""
        groups = self.groups
        out = {(min(g, h), max(g, h)) for g in groups.members for h in groups.neighbours(g)}
        begins = sorted((s[0], g) for g, s in groups.span.items())
        first = np.array([b for b, _ in begins])
        for g, (_, last) in groups.span.items():
            i, j = np.searchsorted(first, (last + 1, last + self.farthest + 1)).tolist()
            out |= {(min(g, h), max(g, h)) for _, h in begins[i:j]}
        for camera in range(len(self.cameras)):
            out |= self._in_gaps(camera)
        return sorted(out)

    def _in_gaps(self, camera: int) -> set[Pair]:
        """Groups of this camera alone with those that have a short enough gap there in which they lie."""
        groups = self.groups
        single = sorted((*groups.span[g], g) for g in groups.members if groups.cameras(g) == 1 and groups.spans[g][camera])
        first = np.array([s[0] for s in single])
        out: set[Pair] = set()
        for g, spans in groups.spans.items():
            own, whole = spans[camera], groups.span[g]
            if groups.cameras(g) == 1:
                continue
            edges = [(whole[0] - 1, whole[0] - 1), *((a, b) for a, b, _ in own), (whole[1] + 1, whole[1] + 1)]
            for (_, before), (after, _) in zip(edges[:-1], edges[1:], strict=True):
                i, j = np.searchsorted(first, (before + 1, after)).tolist()
                near = (s for s in single[i:j] if s[1] < after)
                out |= {
                    (min(g, h), max(g, h))
                    for a, b, h in near
                    if a - before <= self.farthest or after - b <= self.farthest
                }
        return out

    def join_the_clear(self, margin: float = MARGIN, bonus: float = 0.0) -> None:
        """Join pairs round by round while any is clear.

        bonus   nats for one course after the other in space, where targets are known neither to come nor to go
        """
        for self.farthest in REACHES:
            self._join_within(margin, bonus)

    def _join_within(self, margin: float, bonus: float) -> None:
        while True:
            worth = {p: w + bonus * self._may_last(*p) for p, w in self.worths().items()}
            worth = {p: w for p, w in worth.items() if w > 0}
            clear = clear_pairs(self.groups, worth, margin)
            touched: set[int] = set()
            for lead, (g, h) in clear:
                if g in touched or h in touched:
                    continue
                touched |= {g, h}
                self.groups.join(g, h, lead)
            if not touched:
                return


    def _may_last(self, g: int, h: int) -> bool:
        (a, b), (c, d) = self.groups.span[g], self.groups.span[h]
        return max(a, c) > min(b, d) and min(self.groups.cameras(g), self.groups.cameras(h)) >= 2


def clear_pairs(groups: Groups, worth: dict[Pair, float], margin: float) -> list[tuple[float, Pair]]:
    """Pairs whose lead over the best other way is above the margin, the clearest first, with their leads."""
    partners: dict[int, dict[int, float]] = defaultdict(dict)
    for (g, h), value in worth.items():
        partners[g][h] = value
        partners[h][g] = value
    exclude: dict[Pair, bool] = {}

    def excludes(g: int, h: int) -> bool:
        key = (min(g, h), max(g, h))
        if key not in exclude:
            exclude[key] = groups.value(g, h) < 0
        return exclude[key]

    def best(g: int, but: Pair) -> float:
        return max((w for k, w in partners[g].items() if k not in but), default=0.0)

    out = []
    for (g, h), value in worth.items():
        if value <= margin:
            continue
        mine = [(w, k) for k, w in partners[g].items() if k != h and excludes(k, h)]
        theirs = [(w, k) for k, w in partners[h].items() if k != g and excludes(k, g)]
        lead = value
        for w, k in mine:  # g goes with k; what h then gets, against what k gets else
            lead = min(lead, value + best(k, (g, h)) - w - best(h, (g, k)))
        for v, m in theirs:
            lead = min(lead, value + best(m, (g, h)) - v - best(g, (h, m)))
        if lead > margin:
            out.append((lead, (g, h)))
    return sorted(out, reverse=True)
