"""Targets followed from sample to sample by moving box masks.

Most samples are read several at a time: where each target should be in the next few is predicted, all windows are
measured in one go (`look`), and the samples are taken up to the first in which some target is not plainly itself.
That one is looked at again from the latest positions; what is still not plain gets a wider search (`Recovery`).
What is not found stays missing: a prediction moves the box, and never becomes a position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.association.occlusion import Meetings, recent, separate, touched
from vidtrack.tracking.association.prediction import predict
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.static_clutter import Standing
from vidtrack.tracking.detection.threshold import SIGMAS
from vidtrack.tracking.measurement.dispatch import watch
from vidtrack.tracking.measurement.window import (
    BACKGROUND,
    CONTRAST,
    HEIGHT,
    PIXELS,
    PLATEAU,
    ROOM,
    SOFT,
    UNREST,
    WIDTH,
    Seen,
    X,
)
from vidtrack.tracking.reacquisition import CORRUPT, LOST, PREDICTED, SATURATED, Recovery
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.settings import Detection

HALF = 0.54
"""Of the mean of a target's pixels, where its threshold is: half of its peak, as those on the rim are dimmer."""
LEAST = 4.5
"""Sigmas from the background to a target's threshold, at least."""
REACH = 8
"""Samples read at once, at most."""
CACHED = 140_000
"""Pixels measured at once, about: more no longer fit the processor's caches."""
GLANCED = 0.3
"""Share of a look's memory that a glance needs."""
MEMORY = 8
"""Last samples that a prediction rests on."""
PATIENCE = 10
"""Samples that a lost target is sought in every one of; then in every REACH-th."""
CAREFUL = 4
"""Every so many readings the unrest of the background is measured as well."""
FOLLOW = 0.2
"""Share by which the looks of a target (size, contrast, background) follow each new reading."""
MEASURED = 8
"""Values of `look` that go into the rows: X to BACKGROUND."""


_LOOKS = [row - PIXELS for row in (PIXELS, CONTRAST, BACKGROUND, WIDTH, HEIGHT, SOFT, UNREST, PLATEAU)]


class Starts(NamedTuple):
    """Where targets begin, (n,) or (n, 2): frame-buffer px, px a sample, grey levels.

    position, velocity (px a sample), acceleration (px a sample^2)  at sample `first`; NaN: not known
    box                 width and height of its mask
    pixels, contrast, background, size (width and height of the target in its sample's own rows)
                        its looks; NaN where nobody has seen it yet: it is then sought in its box
    """

    position: Array
    velocity: Array
    acceleration: Array
    box: Array
    first: Ints
    pixels: Array
    contrast: Array
    background: Array
    size: Array


class Rows(NamedTuple):
    """What was measured.

    values  (8, samples, n): rows X to BACKGROUND of `look`, NaN where nothing was measured
    corner  (samples, n, 2) px, left and top of the box; flag (samples, n) bits of FLAGS; total_pixels (samples,)
    """

    values: Array
    corner: Array
    flag: NDArray[np.int64]
    total_pixels: Array


class Tracker:
    """Follows n targets through the samples given to `follow`, in order; `rows` is what it measured.

    level     grey level (of pictures turned bright) above which total_pixels counts
    clutter   blobs that stand still and are no target (a metre stick, a lamp): they never become one
    standing  all that stands about: no target is measured while it touches that
    far       whether lost targets are sought in the whole picture
    """

    def __init__(
        self,
        starts: Starts,
        detection: Detection,
        level: float,
        *,
        clutter: Blobs | None = None,
        standing: Standing | None = None,
        far: bool = True,
    ) -> None:
        n = len(starts.first)
        self.detection, self.level, self.starts = detection, level, starts
        self.clutter = np.zeros((2, 0)) if clutter is None else np.stack([clutter.Xf, clutter.Yf])
        self.standing = standing
        unknown = np.full((2, n), np.nan)  # in the order of _LOOKS
        self.looks = np.stack(
            [starts.pixels, starts.contrast, starts.background, *starts.size.T, *unknown, starts.contrast]
        )
        self.missing = np.full(n, -1)  # samples since the target was seen; -1: not begun
        self.times = np.arange(-MEMORY, 0.0)
        self.known = np.full((MEMORY, n, 2), np.nan)
        self.meetings = Meetings(n)
        self.recovery = Recovery(self, far=far)
        self.done, self.reach = 0, 1
        self.waiting: list[Sample] = []
        self._totals: list[int] = []  # pixels of those samples on the targets' side of the threshold
        self._window_pixels = 1e5
        self._marked: NDArray[Any] | None = None
        self.blocks: list[Rows] = []
        self._spans: list[Array] = []  # times of the blocks

    def follow(self, samples: Sequence[Sample]) -> None:
        """Go on through these samples; the last few may wait for more to come, or for `finish`."""
        if not self.blocks and not self.waiting and samples:
            self.times = self.times + samples[0].time
        self.waiting += samples
        self._totals += [self._count(sample) for sample in samples]
        at = 0
        while len(self.waiting) - at >= REACH:
            at += self._step(self.waiting[at : at + REACH])
        del self.waiting[:at]

    def finish(self) -> None:
        """Go through the samples that still wait."""
        while self.waiting:
            del self.waiting[: self._step(self.waiting[:REACH])]

    def rows(self) -> Rows:
        """Everything measured so far."""
        n = len(self.missing)
        if not self.blocks:
            return Rows(np.zeros((MEASURED, 0, n)), np.zeros((0, n, 2)), np.zeros((0, n), np.int64), np.zeros(0))
        values = np.concatenate([block.values for block in self.blocks], axis=1)
        return Rows._make([values, *(np.concatenate(column) for column in list(zip(*self.blocks, strict=True))[1:])])

    def last_positions(self, k: int) -> Array:
        """Positions (k, n, 2) px in the last k samples, at most as many as the memory holds."""
        return self.known[-k:]

    def begin(self, target: int, positions: Array, times: Array, looks: Sequence[float]) -> None:
        """Begin a target that nobody had seen before, from where it was at `times` (m,): positions (m, 2) px.

        looks  pixels, contrast, background, width, height
        """
        self.looks[:, target] = [*looks, np.nan, np.nan, looks[1]]
        for time, where in zip(times, positions, strict=True):
            self.known[np.abs(self.times - time) < 1e-6, target] = where
        self.missing[target] = 0 if abs(times[-1] - self.times[-1]) < 1e-6 else 1

    def levels(self, who: Ints) -> Array:
        """Thresholds, grey levels of pictures turned bright: half-way up each target, or the user's."""
        if self.detection.level is not None:
            return np.full(who.size, self.detection.level)
        background, plateau = self.looks[[2, 7]][:, who]
        level = background + np.maximum(HALF * plateau, LEAST * self.detection.noise)
        # a dim target falls to pieces at the level for lone pixels; enough side by side are no chance at a lower one
        return np.where(np.isfinite(level), level, self.level - (SIGMAS - LEAST) * self.detection.noise)

    def _step(self, samples: Sequence[Sample]) -> int:
        """Take in one or more of the samples; returns how many."""
        self._start(samples[0].time)
        k = min(self._how_many(), len(samples))
        k = next((j for j, sample in enumerate(samples[:k]) if sample.corrupt), k)
        if k == 0:
            self._pass_over(samples[0])
            return 1
        times = np.array([sample.time for sample in samples[:k]])
        predicted = self._predicted(times)
        sharp = np.flatnonzero(self.missing == 0)
        clear, taken = np.zeros((k, 0), bool), k
        block = self._blank(samples[:k], predicted)
        if sharp.size:
            seen = watch(
                samples[:k],
                predicted[:, sharp],
                looks=self.looks[:, sharp],
                threshold=self.levels(sharp),
                detection=self.detection,
                careful=len(self.blocks) % CAREFUL == 0,
            )
            clear = self._not_clutter(seen)
            if self.standing is not None:
                clear = clear & ~self.standing.touched(samples[:k], *seen.values[:2], *self.looks[3:5, sharp])
            if self.missing.size > 1:
                self._separate(clear, sharp, seen, predicted, samples[0].lines)
            whole = clear.all(axis=1)
            taken = k if whole.all() else max(1, int(np.argmin(whole)))
            self._take(block, sharp, seen, clear, taken)
            width, height, soft = self.looks[3:6, sharp] + 2 * ROOM
            glanced = np.isfinite(soft) if self.detection.centroid == "weighted" else np.zeros(sharp.size, bool)
            self._window_pixels = float((width * height * np.where(glanced, GLANCED, 1.0)).sum())
        self._remember(block, times, taken)
        blurred = sharp[~clear[taken - 1]]
        self.missing[self.missing > 0] += taken
        self.missing[blurred] = 1
        if blurred.size and self.missing.size > 1:
            self._meet(blurred, predicted[taken - 1], samples[taken - 1])
        due = (self.missing > 0) & ((self.missing <= PATIENCE) | (self.missing % REACH == 0) | self.meetings.met)
        if due.any():
            self.recovery.seek(samples[taken - 1], np.flatnonzero(due), predicted[taken - 1], block, taken - 1)
        self.reach = min(REACH, self.reach + 1) if taken == k and not blurred.size else taken
        block.total_pixels[:taken] = self._totals[:taken]
        del self._totals[:taken]
        self.blocks.append(Rows._make([block.values[:, :taken], *(column[:taken] for column in block[1:])]))
        self._spans.append(times[:taken])
        self.done += taken
        return taken

    def _start(self, time: float) -> None:
        """Begin the targets whose first sample this is, as if they had been seen on their way there."""
        who = np.flatnonzero((self.missing < 0) & (self.starts.first <= self.done))
        if not who.size:
            return
        position = self.starts.position[who]
        v, a = np.nan_to_num(self.starts.velocity[who]), np.nan_to_num(self.starts.acceleration[who])
        t = self.times[-3:, None, None] - time
        moving = np.isfinite(self.starts.velocity[who, 0])
        self.known[-3:, who[moving]] = (position + t * v + t * t * a / 2)[:, moving]
        self.known[-1, who[~moving]] = position[~moving]
        self.missing[who] = np.where(np.isfinite(self.looks[0, who]), 0, 1)

    def _how_many(self) -> int:
        """As many samples as went well lately, but not past one in which something is to be sought or begun."""
        k = max(1, min(self.reach, int(CACHED / max(self._window_pixels, 1.0))))
        lost = self.missing[self.missing > 0]
        if lost.size:
            k = 1 if self.meetings.met.any() else min(k, int(np.where(lost < PATIENCE, 1, REACH - lost % REACH).min()))
        later = self.starts.first[(self.missing < 0)] - self.done
        return max(1, min(k, int(later.min()) if later.size else k))

    def _predicted(self, times: Array) -> Array:
        where = predict(self.times, self.known, times)
        where = np.where(np.isfinite(where), where, self.starts.position)
        if self.meetings.met.any():
            who = np.flatnonzero(self.meetings.met)
            where[:, who] = self.meetings.at(who, times)
        return where

    def sizes(self, who: Ints, lines: int) -> Array:
        """Width and height (len(who), 2), frame-buffer px."""
        return np.asarray(self.looks[3:5, who].T * (1, lines))

    def _separate(self, clear: Bools, sharp: Ints, seen: Seen, predicted: Array, lines: int) -> None:
        """Targets of which one may hide the other are not clear: `clear` (k, sharp) is changed."""
        met = np.flatnonzero(self.meetings.met)
        who = np.concatenate([sharp, met])
        whole = np.concatenate([clear, np.zeros((len(clear), met.size), bool)], axis=1)
        where = predicted[:, who]
        where[:, : sharp.size] = np.where(clear[..., None], seen.values[:2].transpose(1, 2, 0), where[:, : sharp.size])
        separate(whole, where, self.sizes(who, lines))
        clear[:] = whole[:, : sharp.size]

    def _meet(self, blurred: Ints, predicted: Array, sample: Sample) -> None:
        """Those of the targets lost just now that touch another one that is lost have met it."""
        lost = np.flatnonzero((self.missing > 0) & ((self.missing <= PATIENCE) | self.meetings.met))
        size = self.sizes(lost, sample.lines)
        together = lost[touched(predicted[lost], size)]
        if not np.isin(blurred, together).any():
            return
        times, positions = recent(self._spans, [block.values[:2] for block in self.blocks])
        if times.size:
            self.meetings.begin(together, times, positions, self.sizes(np.arange(self.missing.size), sample.lines) / 2)
            met = together[self.meetings.met[together]]
            predicted[met] = self.meetings.at(met, np.array([sample.time]))[0]

    def _blank(self, samples: Sequence[Sample], predicted: Array) -> Rows:
        """Rows in which every target is lost, its box where it is expected."""
        k, n = predicted.shape[:2]
        flag = np.full((k, n), LOST | PREDICTED, np.int64)
        corner = predicted - self.starts.box / 2
        unborn = self.missing < 0
        if unborn.any():
            flag[:, unborn] = LOST
            corner[:, unborn] = np.nan
        return Rows(np.full((MEASURED, k, n), np.nan), corner, flag, np.zeros(k))

    def _count(self, sample: Sample) -> int:
        """Pixels of a whole sample on the targets' side of the threshold.

        Done as a sample comes: whoever cuts windows from it soon finds it in the processor's caches.
        """
        level, kind = self.level / self.detection.scale, cv2.THRESH_BINARY
        if self.detection.dark:  # BINARY_INV keeps what is not above: a dark pixel lies below the level
            level, kind = float(np.ceil(self.detection.full - level)) - 1, cv2.THRESH_BINARY_INV
        luma = sample.luma
        if self._marked is None or self._marked.shape != luma.shape or self._marked.dtype != luma.dtype:
            self._marked = np.empty(luma.shape, luma.dtype)
        cv2.threshold(luma, level, 1, kind, dst=self._marked)
        return cv2.countNonZero(self._marked)

    def _not_clutter(self, seen: Seen) -> Bools:
        """Clear, and not one of the things that stood still from the beginning."""
        if not self.clutter.size:
            return seen.clear
        near = np.abs(seen.values[:2, ..., None] - self.clutter[:, None, None]) < 1.5
        return np.asarray(seen.clear & ~near.all(axis=0).any(axis=-1))

    def _take(self, block: Rows, who: Ints, seen: Seen, clear: Bools, taken: int) -> None:
        """Write what was plainly seen in the first `taken` samples, and let the looks follow light and distance."""
        good, every = clear[:taken], slice(None) if who.size == len(self.missing) else who
        about = seen.values[:2, :taken].transpose(1, 2, 0) - self.starts.box[every] / 2
        looks = seen.values[PIXELS:, :taken]
        if good.all():
            block.values[:, :taken, every] = seen.values[:MEASURED, :taken]
            block.flag[:taken, every] = seen.saturated[:taken] * SATURATED
            block.corner[:taken, every] = about
            count: Any = taken
        else:
            block.values[:, :taken, every] = np.where(good, seen.values[:MEASURED, :taken], np.nan)
            block.flag[:taken, every] = np.where(good, seen.saturated[:taken] * SATURATED, LOST | PREDICTED)
            block.corner[:taken, every] = np.where(good[..., None], about, block.corner[:taken, every])
            count = good.sum(axis=0)
            looks = np.where(good, looks, 0)
        mean = looks.sum(axis=1)[_LOOKS] / np.where(count, count, np.nan)
        old = self.looks[:, every]
        # what motion alone has shown of a target is rough: its first look counts whole
        old = np.where((np.isfinite(old) & np.isfinite(old[5])) | (count == 0), old, mean)
        self.looks[:, every] = np.where(count, old + (1 - (1 - FOLLOW) ** count) * (mean - old), old)

    def _remember(self, block: Rows, times: Array, taken: int) -> None:
        fresh = block.values[:2, :taken].transpose(1, 2, 0)
        kept = np.concatenate([self.known, fresh])[-MEMORY:]
        self.times = np.concatenate([self.times, times[:taken]])[-MEMORY:]
        gone = np.isnan(kept[..., 0]).all(axis=0) & (self.missing >= 0)
        if gone.any():  # the last position stays, so that the box does
            kept[0, gone] = self._last_known(gone)
        self.known = kept

    def _last_known(self, gone: Bools) -> Array:
        known = self.known[:, gone]
        seen = np.isfinite(known[..., 0])
        newest = MEMORY - 1 - np.argmax(seen[::-1], axis=0)
        last: Array = known[newest, np.arange(known.shape[1])]
        return np.where(np.isfinite(last), last, self.starts.position[gone])

    def _pass_over(self, sample: Sample) -> None:
        """A damaged picture: whatever it shows is no measurement."""
        times = np.array([sample.time])
        block = self._blank([sample], self._predicted(times))
        block.flag[:] = CORRUPT | PREDICTED
        self._remember(block, times, 1)
        block.total_pixels[0] = self._totals.pop(0)
        self.blocks.append(block)
        self._spans.append(times)
        self.done += 1


def present(rows: Rows) -> Bools:
    """Where a target was measured, (samples, n)."""
    return np.asarray(np.isfinite(rows.values[X]))
