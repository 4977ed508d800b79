"""Blobs that were followed as one target and are two: balls that touch or overlap from the beginning.

Nothing in a track says so but its shape. What is followed is looked at now and then where it is no disc; where two
discs explain it (`two_discs`), in two samples, it is followed as two from then on, that hide each other. What was
measured of it before was of neither, as far back as it had the size or the shape of both. A target that was seen alone
before is followed as the one that it was: what touches it may be a spark on the water.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.discs.clump import FEWEST, elongation
from vidtrack.tracking.discs.joint_fit import SHAPE
from vidtrack.tracking.discs.three_discs import reach, reaching
from vidtrack.tracking.discs.two_discs import TWO_DISCS, Pair
from vidtrack.tracking.following.record import Record
from vidtrack.tracking.state import PIXELS, XX, XY, YY, TargetState, X


@dataclass(frozen=True)
class Declumping:
    """When a blob is looked at, and how far back it was two.

    every      samples from one look to the next; longest: after many in vain
    as_one     samples without a look after one that showed one disc, as long as it is not longer, and does not reach
               farther, by `more` than it did then
    confirmed  looks in a row that must find two discs
    larger     of a disc's pixels, from which on a sample before shows more than one; rounder: share of the elongation
               that a blob is looked at from, below which it may be one
    alone      samples in a row that show one disc, before which the blob was one target
    """

    every: int = 8
    longest: int = 128
    as_one: int = 2048
    more: tuple[float, float] = (0.03, 0.015)
    confirmed: int = 2
    larger: float = 1.1
    rounder: float = 0.5
    alone: int = 3


DECLUMPING = Declumping()


class Looks(NamedTuple):
    """What discs (m,) look like: pixels, contrast (grey levels), background, width px and height in rows."""

    pixels: Array
    contrast: Array
    background: Array
    width: Array
    height: Array


class Clumps:
    """Which of so many places may hold two, and when each is looked at."""

    def __init__(self, places: int) -> None:
        self._next = np.zeros((2, places), np.int64)  # of what is long, and of what only reaches far
        self._vain = np.zeros((2, places), np.int64)
        self._round = np.zeros(places, np.intp)
        self._one = np.full((2, places), -np.inf)  # elongation and reach up to which a target is known to be one
        self._until_then = np.zeros((2, places), np.int64)
        self._shape = np.zeros((2, places))
        self._found = np.zeros(places, np.int64)
        self._disc = np.full(places, np.nan)  # pixels of a target that something touches
        self._until = np.zeros(places, np.int64)
        self.partner = np.full(places, -1)

    @property
    def shared(self) -> Bools:
        """Places (n,) whose blobs are more than the target."""
        return np.asarray(np.isfinite(self._disc))

    def due(self, values: Array, state: TargetState, number: int, lines: int) -> Ints:
        """Places whose blobs are to be looked at in the sample of this number.

        values  (MEASURED, places) what was measured in it
        """
        pixels = state.appearance.pixels * lines  # of many samples: the grid changes a single count
        self._shape = np.stack([elongation(*values[[XX, YY, XY]]), reach(pixels, *values[[XX, YY]])])
        large = values[PIXELS] * lines >= FEWEST
        with np.errstate(invalid="ignore"):
            long, far = self._shape[0] > TWO_DISCS.elongated, reaching(pixels, *values[[XX, YY]])
            odd = np.stack([long, far & ~long]) & ((self._shape > self._one) | (self._until_then <= number))
            due = (odd | (self._found > 0)) & (self._next <= number)
            self._round = np.where(long, 0, 1)
            return np.flatnonzero((state.missing == 0) & due.any(axis=0) & large & np.isnan(self._disc))

    def looked(self, i: int, number: int, found: Pair | float | None, *, one: bool = False) -> bool:
        """A place was looked at; whether it is two, or three. one: it may well be one disc."""
        kind = self._round[i]
        if one:
            self._one[kind, i] = self._shape[kind, i] + DECLUMPING.more[kind]
            self._until_then[kind, i] = number + DECLUMPING.as_one
        if found is None:
            self._vain[kind, i], self._found[i] = self._vain[kind, i] + 1, 0
            times = int(self._vain[kind, i]) // (1 if kind else 3)
            wait = min(DECLUMPING.every * 2 ** min(times, 8), DECLUMPING.longest)
            self._next[kind, i] = number + wait
            return False
        self._found[i] += 1
        self._vain[:, i], self._next[:, i] = 0, number + 1
        return bool(self._found[i] >= DECLUMPING.confirmed)

    def taken_back(self, i: int, record: Record, track: int, found: Pair | float) -> bool:
        """Take back what was recorded of two or three as one; whether one of them was seen alone before.

        found  what it shows: two, or three discs of so many pixels, which are not followed apart: nothing is measured
               until one is seen alone
        """
        pixels = found if isinstance(found, float) else float(looks_of(found).pixels.max())
        samples, values = record.of_track(track)
        first = first_of_both(values, pixels)
        record.unmeasured(track, samples[first:])
        if first > 0 or isinstance(found, float):
            self._disc[i], self._until[i], self._found[i] = pixels, record.samples - 1, 0
        return first > 0

    def unmeasured(self, record: Record, track: Ints, every: int = DECLUMPING.every) -> None:
        """Take back what was recorded of a target and what touches it, each so many samples; track: of each place."""
        number = record.samples - 1
        for i in np.flatnonzero(number - self._until >= np.where(np.isnan(self._disc), np.inf, every)).tolist():
            samples, values = record.of_track(int(track[i]))
            several = more_than_one(values, self._disc[i])
            record.unmeasured(int(track[i]), samples[several & (samples > self._until[i])])
            self._until[i] = number
            if not several[-DECLUMPING.alone :].any():
                self._disc[i] = np.nan

    def joined(self, i: int, j: int) -> None:
        """These two places are the halves of one blob."""
        self.forget(np.array([i, j]))
        self.partner[i], self.partner[j] = j, i

    def forget(self, who: Ints) -> None:
        """Whatever is in these places is another thing now."""
        former = self.partner[who]
        self.partner[former[former >= 0]] = -1
        self.partner[who], self._disc[who] = -1, np.nan
        self._next[:, who] = self._vain[:, who] = self._found[who] = 0
        self._one[:, who] = -np.inf


def looks_of(pair: Pair) -> Looks:
    """The looks of two discs."""
    assert len(pair.shape) == SHAPE
    rx, ry, light, blur = np.exp(pair.shape)
    pixels = np.pi * rx * ry
    contrast = light * np.pi * (rx * ry + blur**2 + 1 / 12) / pixels
    return Looks(pixels, contrast, pair.background, 2 * rx, 2 * ry)


def first_of_both(values: Array, pixels: float) -> int:
    """The sample from which on a blob was two, of its samples in values (MEASURED, k), the last of which is.

    pixels  of one disc
    """
    single = ~more_than_one(values, pixels)
    alone: list[int] = []
    for k in np.flatnonzero(np.isfinite(values[X]))[::-1].tolist():
        alone = [*alone, k] if single[k] else []
        if len(alone) == DECLUMPING.alone:
            return alone[0] + 1
    return 0


def more_than_one(values: Array, pixels: float) -> Bools:
    """Samples (k,) that show more than a disc of so many pixels, of values (MEASURED, k)."""
    long = elongation(*values[[XX, YY, XY]]) > DECLUMPING.rounder * TWO_DISCS.elongated
    return np.asarray(long | (values[PIXELS] >= DECLUMPING.larger * pixels))
