"""Looks at the rims of the targets of a recording: now and then, and at every sample where one was found uneven."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.order_statistics import median
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.outlines.rim import look_at_rims, middle_of_arc, middle_of_rim
from vidtrack.tracking.outlines.uneven_light import Ways
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import PIXELS, X, Y


@dataclass(frozen=True)
class UnevenRims:
    """When a rim is uneven, and what that says of the centroid.

    every, at_once  samples from look to look at a target, as long as its rim is even; targets looked at then, in turn
    beyond          sd of a place of the rim that its unevenness is at least; 0.4 to 0.9 of plain discs, at most 1.3
    lasting, apart  the same of its mean over about `memory` looks; sd of a place of the rim that the middle is then off
    memory
    look_on         the same from which on every sample is looked at
    shaped          `Looked.shaped` of one look, and of its mean over `memory` looks, of what is no chance and no grain
    grain_px        what codecs make of a place of a rim, besides noise
    moved           share of the way to the middle of the round part that is not known
    dented          share of the unevenness that is an error of the middle: where part of the rim is a circle's, and
                    where none is
    furthest        of the mean distance of the rim, which no middle is from the centroid
    beside          samples after one that was moved, and before, in which a rim that was not looked at is taken for as
                    uneven: what was searched for, and the first
    """

    every: int = 4
    at_once: int = 16
    beyond: float = 1.4
    lasting: float = 0.8
    apart: float = 2.5
    memory: int = 3
    look_on: float = 0.75
    shaped: tuple[float, float] = (2.5, 1.4)
    grain_px: float = 0.02
    moved: float = 0.25
    dented: tuple[float, float] = (0.5, 1.0)
    furthest: float = 0.9
    beside: int = 4


UNEVEN_RIMS = UnevenRims()
_LOOKED_AT = [X, Y, PIXELS]


class Rims:
    """What the rims of n targets show."""

    def __init__(self, n: int, detection: Detection) -> None:
        self._n, self._detection = n, detection
        self._lately = np.zeros(n)  # unevenness over the sd of a place of the rim, 0: not looked at
        self._shaped = np.ones(n)  # mean of what is seen of it lately
        self._odd = np.zeros(0, np.intp)  # targets of which every sample is looked at
        self._turn = self._next = 0
        self._before: deque[tuple[int, Sample, Array]] = deque(maxlen=UNEVEN_RIMS.every - 1)
        self._ways = Ways(n)
        # samples, targets, way to the middle (2, m), its sd (m,), sd of a place of the rim (m,)
        self._found: list[tuple[Ints, Ints, Array, Array, Array]] = []
        self._looked: list[tuple[Ints, Ints]] = []  # samples and targets, while every sample is looked at

    def passed(self, samples: Sequence[Sample], first: int, values: Array) -> None:
        """Look at samples, the first of which has this number; values (MEASURED, samples or more, n or more) of what is
        plainly itself in them: what was searched for may be fitted beside or behind another, and its rim is theirs too.
        """
        if not self._n:
            return
        every = values[_LOOKED_AT, : len(samples), : self._n]  # a copy: what is searched for is put in later
        for j, sample in enumerate(samples):
            number, own = first + j, every[:, j]
            who = self._odd
            if number >= self._next:
                self._next = number + UNEVEN_RIMS.every
                who = np.union1d(who, self._due())
            if who.size:
                new = self._look(number, sample, own, who)
                for past in self._before if new.size else ():
                    self._look(*past, new)
                self._odd = np.flatnonzero(self._lately > UNEVEN_RIMS.look_on)
            self._before.append((number, sample, own))

    def _due(self) -> Ints:
        """Whose turn it is."""
        if self._n <= UNEVEN_RIMS.at_once:
            return np.arange(self._n)
        who = (self._turn + np.arange(UNEVEN_RIMS.at_once)) % self._n
        self._turn = int(who[-1]) + 1
        return who

    def _look(self, number: int, sample: Sample, values: Array, who: Ints) -> Ints:
        """Look at some targets in a sample; which of them are to be looked at more closely and were not.

        values  (3, n) as _LOOKED_AT
        """
        who = who[np.isfinite(values[0, who])]
        if not who.size:
            return who
        d = self._detection
        x, y, pixels = values[:, who]
        at = np.stack([x, sample.row(y)], axis=1)
        seen = look_at_rims(d.bright(sample.luma), at, pixels, d.noise, lines=sample.lines, scale=d.scale)
        able = np.isfinite(seen.sd)
        who, uneven, rim = who[able], seen.uneven[able], seen.rim[able]
        sd = np.hypot(seen.sd[able], UNEVEN_RIMS.grain_px * sample.lines)
        now, before = uneven / sd, self._lately[who]
        lately = np.where(before > 0, before + (now - before) / UNEVEN_RIMS.memory, now)
        self._lately[who] = np.minimum(lately, UNEVEN_RIMS.beyond)
        if (closely := who[lately > UNEVEN_RIMS.look_on]).size:
            self._looked.append((np.full(closely.size, number), closely))
        shaped = seen.shaped[able]
        self._shaped[who] += (np.minimum(shaped, UNEVEN_RIMS.shaped[0]) - self._shaped[who]) / UNEVEN_RIMS.memory
        (by_rim, error), by_side = middle_of_rim(rim, sd), middle_of_rim(seen.edge[able], sd)[0]
        # a bright point on one side raises its level, so that its edge goes farther than the light; the rim does not
        nearer = (
            (seen.sided[able] == 0) & ((by_rim * by_side).sum(axis=0) > 0) & (np.hypot(*by_rim) < np.hypot(*by_side))
        )
        way = np.where(nearer, by_rim, by_side)
        self._ways.seen(number, who, way, error, (now < UNEVEN_RIMS.beyond) & np.isfinite(by_side[0]))
        plainly = (shaped > UNEVEN_RIMS.shaped[0]) | (self._shaped[who] > UNEVEN_RIMS.shaped[1])
        if (some := np.flatnonzero(plainly & ((now > UNEVEN_RIMS.beyond) | (lately > UNEVEN_RIMS.lasting)))).size:
            who_of, uneven, rim, sd = who[some], uneven[some], rim[some], sd[some]
            way, good = middle_of_arc(rim, sd)
            off = np.hypot(*way)
            good &= off < UNEVEN_RIMS.furthest * rim.mean(axis=1)
            plainly = (now[some] > UNEVEN_RIMS.beyond) | (good & (off > UNEVEN_RIMS.apart * sd))
            way = np.where(good, way, 0.0)
            more = np.hypot(UNEVEN_RIMS.moved * np.hypot(*way), np.where(good, *UNEVEN_RIMS.dented) * uneven)
            which = np.flatnonzero(plainly)
            self._found.append((np.full(which.size, number), who_of[which], way[:, which], more[which], sd[which]))
        return who[(lately > UNEVEN_RIMS.look_on) & (before <= UNEVEN_RIMS.look_on)]

    def followed_back(self, back: Rims, moved: Callable[[Ints, Ints], tuple[Ints, Ints, Bools]]) -> None:
        """As `Surfaces.followed_back`."""
        self._ways.followed_back(back._ways, moved)
        for sample, who in back._looked:
            at, here, good = moved(sample, who)
            self._looked.append((at[good], here[good]))
        for sample, who, way, more, sd in back._found:
            at, here, good = moved(sample, who)
            self._found.append((at[good], here[good], way[:, good], more[good], sd[good]))

    def corrected(
        self, position: Array, sd: Array, own: Array, lit: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """Positions and sd (2, k, n) px of the targets, moved to the middle of what is round of them.

        own  (2, k, n) px, the sd without what surfaces say: light and dark on a target do not move its rim
        lit  (2, k, n) px, ways from the light of targets that are lit from one side to their outlines, and their sd
             (k, n) px: they are moved by these, and what hides a part of them is in the sd
        """
        sd = self._ways.grown(sd, own, position if lit is not None else None)
        if self._found:
            parts = (np.concatenate(parts, axis=-1) for parts in zip(*self._found, strict=True))
            sample, who, way, more, place = parts
            _, once = np.unique(sample * self._n + who, return_index=True)
            sample, who, way, more, place = sample[once], who[once], way[:, once], more[once], place[once]
            sd = sd.copy()
            if lit is not None:
                off = self._beside(way - lit[0][:, sample, who], who, np.isfinite(position[0]).sum(axis=0))
                off[~(off > UNEVEN_RIMS.apart * place)] = 0.0
                sd[:, sample, who] = np.hypot(sd[:, sample, who], off)
            else:
                for i, rows, off in self._passed_over(sample, who, np.hypot(*way), np.isfinite(position[0])):
                    sd[:, rows, i] = np.hypot(sd[:, rows, i], off)
                position = position.copy()
                position[:, sample, who] += way
                by_light = np.where(way.any(axis=0), own[:, sample, who], sd[:, sample, who])
                sd[:, sample, who] = np.hypot(by_light, more)
        return (position, sd) if lit is None else (position + lit[0], np.hypot(sd, lit[1]))

    def _passed_over(self, sample: Ints, who: Ints, off: Array, measured: Bools) -> Iterator[tuple[int, Ints, Array]]:
        """Of each target samples that were not looked at beside such as were moved, and how far these were, px.

        sample, who, off  (m,) that were moved; measured: (k, n)
        """
        looked = np.zeros(measured.shape, bool)
        for at, those in self._looked:
            looked[at, those] = True
        looked[sample, who] = True
        for i in np.unique(who).tolist():
            own = np.flatnonzero(who == i)
            own = own[np.argsort(sample[own], kind="stable")]
            moved, rows = sample[own], np.flatnonzero(measured[:, i] & ~looked[:, i])
            after = np.minimum(np.searchsorted(moved, rows), moved.size - 1)
            before = np.maximum(after - 1, 0)
            near = [np.where(np.abs(moved[k] - rows) <= UNEVEN_RIMS.beside, off[own[k]], 0.0) for k in (before, after)]
            yield i, rows, np.maximum(*near)

    def _beside(self, off: Array, who: Ints, measured: Ints) -> Array:
        """How far (m,) middles of rims lie from outlines (2, m) px, but for what they do in most samples of a target:
        the light's own part; measured: samples of each.
        """
        off = off.copy()
        for i in np.unique(who).tolist():
            rows = np.flatnonzero(who == i)
            if 2 * rows.size > measured[i]:
                off[:, rows] -= median(off[:, rows].T)[:, None]
        return np.asarray(np.hypot(*off))
