"""Groups joined where lines of sight leave it open: by the motion as well, in space and in each picture.

A pair of groups is worth what its lines of sight tell and what the motion tells at the seams of its joint course. Pairs
are joined, the clearest first, while the next best way to give their parts to others is less likely by `MARGIN`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.continuity import Motion
from vidtrack.association.courses import AROUND, Course, Rows, courses, motion_of, seam_evidence
from vidtrack.association.groups import MARGIN, Groups
from vidtrack.geometry.camera import Camera

Pair = tuple[int, int]

FARTHEST = 200
"""Moments that a gap may last to be bridged by the motion."""


class Bridges:
    """Worth of joining groups, remembered while neither changes."""

    def __init__(self, cameras: Sequence[Camera], rows: Rows, groups: Groups) -> None:
        self.cameras, self.rows, self.groups = cameras, rows, groups
        self.order = np.lexsort((rows.moment, rows.node))
        self.edges = np.searchsorted(rows.node[self.order], np.arange(len(groups.root) + 1))
        self.known: dict[tuple[Pair, int, int], float] = {}
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

    def span(self, g: int) -> tuple[int, int]:
        """First and last moment of a group."""
        nodes = self.groups.members[g]
        first, last = self.groups.nodes.first, self.groups.nodes.last
        return min(first[n] for n in nodes), max(last[n] for n in nodes)

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
        sights = {p: self.groups.value(*p) for p in fresh}
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
        """The rows of two groups about the shorter one, and which of them each belongs to."""
        spans = [self.span(g) for g in pair]
        low, high = min(spans, key=lambda s: s[1] - s[0])
        rows, parts = [], []
        for k, g in enumerate(pair):
            nodes = [
                n
                for n in self.groups.members[g]
                if self.groups.nodes.first[n] <= high + FARTHEST and self.groups.nodes.last[n] >= low - FARTHEST
            ]
            if not nodes:
                continue
            row = self.rows_of_nodes(nodes)
            rows.append(row)
            parts.append(np.full(len(row), k + 1))
        return np.concatenate(rows), np.concatenate(parts)

    def _candidates(self) -> list[Pair]:
        """Pairs of groups that fit, or of which one ends, in some camera or altogether, shortly before the other."""
        groups = self.groups
        out = {(min(g, h), max(g, h)) for g in groups.members for h in groups.neighbours(g)}
        spans = {g: self.span(g) for g in groups.members}
        begins = sorted((s[0], g) for g, s in spans.items())
        first = np.array([b for b, _ in begins])
        for g, (_, last) in spans.items():
            for k in range(int(np.searchsorted(first, last + 1)), int(np.searchsorted(first, last + FARTHEST, "right"))):
                h = begins[k][1]
                out.add((min(g, h), max(g, h)))
        # one that lies in a gap of another, in its own camera
        for g, own in groups.spans.items():
            for h in self._fill_gaps(g, own, spans):
                out.add((min(g, h), max(g, h)))
        return sorted(out)

    def _fill_gaps(self, g: int, own: list[list[tuple[int, int, int]]], spans: dict[int, tuple[int, int]]) -> list[int]:
        """Single tracklets that lie in a gap of the group in their camera."""
        out = []
        for camera, theirs in enumerate(own):
            if not theirs:
                continue
            for h, (low, high) in self._single[camera].items():
                k = np.searchsorted([s[0] for s in theirs], high, "right")
                if (not k or theirs[k - 1][1] < low) and h != g and low <= spans[g][1] and high >= spans[g][0]:
                    out.append(h)
        return out

    @property
    def _single(self) -> dict[int, dict[int, tuple[int, int]]]:
        out: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
        for g, nodes in self.groups.members.items():
            if len({self.groups.nodes.camera[n] for n in nodes}) == 1:
                out[self.groups.nodes.camera[nodes[0]]][g] = self.span(g)
        return out

    def join_the_clear(self, margin: float = MARGIN, bonus: float = 0.0) -> None:
        """Join pairs round by round while any is clear; `bonus` nats for every pair, where targets are known to last."""
        while True:
            worth = {p: w + bonus for p, w in self.worths().items() if w + bonus > 0}
            clear = clear_pairs(self.groups, worth, margin)
            touched: set[int] = set()
            for _, (g, h) in clear:
                if g in touched or h in touched:
                    continue
                touched |= {g, h}
                self.groups.join(g, h)
            if not touched:
                return


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

    out = []
    for (g, h), value in worth.items():
        if value <= margin:
            continue
        mine = [(0.0, -1)] + [(w, k) for k, w in partners[g].items() if k != h and excludes(k, h)]
        theirs = [(0.0, -1)] + [(w, k) for k, w in partners[h].items() if k != g and excludes(k, g)]
        lead = value
        for w, k in mine:
            for v, m in theirs:
                freed = partners[k].get(m, 0.0) if k >= 0 and m >= 0 else 0.0
                lead = min(lead, value + freed - w - v)
        if lead > margin:
            out.append((lead, (g, h)))
    return sorted(out, reverse=True)


def as_array(x: Sequence[float]) -> Array:
    """Values as an array."""
    return np.asarray(x, float)
