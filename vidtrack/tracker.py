"""Targets followed from sample to sample by moving box masks.

Most samples are read several at a time: where each target should be in the next few is predicted, all windows are
measured in one go (`look`), and the samples are taken up to the first in which some target is not plainly itself.
That sample gets a wider search (`seek`): first in the targets' boxes, then in the whole picture, and blobs are
given to targets one to one. What is not found stays missing: a prediction moves the box, never becomes a position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.assignment import one_to_one
from vidtrack.blobs import Blobs
from vidtrack.detection import Detection
from vidtrack.look import Seen, look
from vidtrack.extrapolation import predict
from vidtrack.sample import Sample
from vidtrack.seek import blobs_near, blobs_of, contrast_of, unlikeness, within

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

LOST, RECOVERED, PREDICTED, EDGE, SATURATED, MERGED, SMALL, CORRUPT = (1 << bit for bit in range(8))
FLAGS = ("lost", "recovered", "predicted", "edge", "saturated", "merged", "small", "corrupt")
"""The words of the flags, by bit."""

REACH = 8
"""Samples read at once, at most."""
MEMORY = 8
"""Last samples that a prediction rests on."""
PATIENCE = 10
"""Samples that a lost target is sought in every one of; then in every REACH-th."""
FOLLOW = 0.2
"""Share by which the looks of a target (size, contrast, background) follow each new reading."""
CROPS = 24
"""Pieces of pictures kept to show the worst moments."""


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
    """What was measured, (k samples, n targets), NaN where nothing was; total_pixels (k,)."""

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    pixels: Array
    mass: Array
    contrast: Array
    background: Array
    box_x: Array
    box_y: Array
    flag: NDArray[np.int64]
    total_pixels: Array


class Crop(NamedTuple):
    """A piece of a picture at a bad moment: (rows, columns) of the sample, its number, the target and the flag."""

    sample: int
    target: int
    flag: int
    picture: NDArray[np.uint8]


class Tracker:
    """Follows n targets through the samples given to `follow`, in order; `rows` is what it measured.

    clutter  blobs that stand still and are no target (a metre stick, a lamp): they never become one
    level    grey level (of pictures turned bright) above which total_pixels counts
    """

    def __init__(
        self, starts: Starts, detection: Detection, level: float, *, clutter: Blobs | None = None, far: bool = True
    ) -> None:
        n = len(starts.first)
        self.detection, self.level, self.starts, self.far = detection, level, starts, far
        self.clutter = clutter if clutter is not None and clutter.Xf.size else None
        self.pixels, self.contrast, self.background = (
            starts.pixels.copy(),
            starts.contrast.copy(),
            starts.background.copy(),
        )
        self.size = starts.size.copy()
        self.missing = np.where(starts.first <= 0, 0, -1)  # samples since the target was seen; -1: not begun
        self.missing[(self.missing == 0) & ~np.isfinite(starts.pixels)] = 1
        self.times = np.full(MEMORY, -1e9)
        self.known = np.full((MEMORY, n, 2), np.nan)
        self.pending = np.full((n, 3), np.nan)
        self.done, self.reach = 0, 1
        self.blocks: list[Rows] = []
        self.crops: list[Crop] = []
        self._begun = False

    def follow(self, samples: Sequence[Sample]) -> None:
        """Go on through these samples."""
        at = 0
        while at < len(samples):
            if not self._begun:
                self._begin(samples[0])
            at += self._step(samples[at : at + REACH])

    def rows(self) -> Rows:
        """Everything measured so far."""
        if not self.blocks:
            n = len(self.starts.first)
            return Rows._make([*(np.zeros((0, n)) for _ in range(10)), np.zeros((0, n), np.int64), np.zeros(0)])
        return Rows._make(np.concatenate(column) for column in zip(*self.blocks, strict=True))

    def last(self, k: int) -> Rows:
        """The last k samples' rows, without those of the samples before."""
        blocks: list[Rows] = []
        held = 0
        while held < k:
            blocks.append(self.blocks[-1 - len(blocks)])
            held += len(blocks[-1].total_pixels)
        return Rows._make(np.concatenate(column)[-k:] for column in zip(*reversed(blocks), strict=True))

    def begin(self, target: int, position: Array, pixels: float, contrast: float, size: Array, times: Array) -> None:
        """Begin a target that nobody had seen before, from where it was at `times` (m,): positions (m, 2) px.

        The times must be among the last samples'; pixels, contrast (grey levels), size (2,) are its looks.
        """
        self.pixels[target], self.contrast[target], self.size[target] = pixels, contrast, size
        for time, where in zip(times, position, strict=True):
            self.known[np.abs(self.times - time) < 1e-6, target] = where
        self.missing[target] = 0 if times[-1] == self.times[-1] else 1

    def _begin(self, sample: Sample) -> None:
        self._begun = True
        self._place(np.flatnonzero(self.starts.first <= 0), sample.time)

    def _place(self, who: Ints, time: float) -> None:
        """Put what is known of a start into the memory, as if the target had been seen on its way there."""
        back = np.array([3.0, 2.0, 1.0])
        if not np.isfinite(self.times[-3:]).all() or self.times[-1] < -1e8:
            self.times[-3:] = time - back
        moving = who[np.isfinite(self.starts.velocity[who, 0])]
        v, a = self.starts.velocity[moving], np.nan_to_num(self.starts.acceleration[moving])
        t = self.times[-3:, None, None] - time
        self.known[-3:, moving] = self.starts.position[moving] + t * v + t * t * a / 2
        still = np.setdiff1d(who, moving)
        self.known[-1, still] = self.starts.position[still]

    def _predicted(self, who: Ints, times: Array) -> Array:
        where = predict(self.times, self.known[:, who], times)
        return np.where(np.isfinite(where), where, self.starts.position[who])

    def _step(self, samples: Sequence[Sample]) -> int:
        """Take in one or more of the samples; returns how many."""
        fresh = np.flatnonzero((self.missing < 0) & (self.starts.first <= self.done))
        if fresh.size:
            self._place(fresh, samples[0].time)
            self.missing[fresh] = np.where(np.isfinite(self.pixels[fresh]), 0, 1)
        k = min(self._how_many(), len(samples))
        corrupt = next((j for j, sample in enumerate(samples[:k]) if sample.corrupt), k)
        if corrupt == 0:
            self._skip(samples[0])
            return 1
        samples = samples[:corrupt]
        k = len(samples)
        times = np.array([sample.time for sample in samples])
        block = self._blank(samples, times)
        sharp = np.flatnonzero(self.missing == 0)
        taken = k
        if sharp.size:
            predicted = self._predicted(sharp, times)
            seen = look(
                samples,
                predicted,
                size=self.size[sharp],
                pixels=self.pixels[sharp],
                threshold=self._levels(sharp),
                detection=self.detection,
            )
            clear = self._not_clutter(seen)
            whole = clear.all(axis=1)
            taken = k if whole.all() else int(np.argmin(whole)) + 1
            self._take(block, sharp, seen, clear, taken)
            self._remember(sharp, seen, clear, times, taken)
        else:
            clear = np.zeros((k, 0), bool)
            self._remember(sharp, None, clear, times, taken)
        blurred = sharp[~clear[taken - 1]]
        self.missing[self.missing > 0] += taken
        self.missing[blurred] = 1
        due = (self.missing > 0) & ((self.missing <= PATIENCE) | (self.missing % REACH == 0))
        if due.any():
            self._mend(samples[taken - 1], np.flatnonzero(due), block, taken - 1)
        self.reach = min(REACH, 2 * self.reach) if not blurred.size else max(1, taken - 1)
        self.blocks.append(Rows._make(values[:taken] for values in block))
        self.done += taken
        return taken

    def _how_many(self) -> int:
        """As many samples as went well lately, but not past one in which something is to be sought or begun."""
        k = self.reach
        lost = self.missing[self.missing > 0]
        if lost.size:
            wait = np.where(lost < PATIENCE, 1, REACH - lost % REACH)
            k = min(k, int(wait.min()))
        later = self.starts.first[(self.missing < 0)] - self.done
        return max(1, min(k, int(later.min()) if later.size else k))

    def _levels(self, who: Ints) -> Array:
        """Thresholds, grey levels of pictures turned bright: half-way up each target, or the user's."""
        if self.detection.level is not None:
            return np.full(who.size, self.detection.level)
        half = np.maximum(0.5 * self.contrast[who], 4.5 * self.detection.noise)
        level = self.background[who] + half
        return np.where(np.isfinite(level), level, self.level)

    def _blank(self, samples: Sequence[Sample], times: Array) -> Rows:
        """Rows in which every target is lost, its box where it is expected."""
        k, n = len(samples), len(self.missing)
        values = [np.full((k, n), np.nan) for _ in range(8)]
        flag = np.full((k, n), LOST, np.int64)
        where = self._predicted(np.arange(n), times)
        box = where - self.starts.box / 2
        box[:, self.missing < 0] = np.nan
        total = np.array([self._count(sample) for sample in samples], float)
        flag[:, self.missing >= 0] |= PREDICTED
        return Rows._make([*values, box[..., 0], box[..., 1], flag, total])

    def _count(self, sample: Sample) -> int:
        """Pixels of the whole sample on the targets' side of the threshold."""
        level = (255.0 - self.level if self.detection.dark else self.level) / self.detection.scale
        kind = cv2.THRESH_BINARY_INV if self.detection.dark else cv2.THRESH_BINARY
        # INV keeps what is not above: a dark pixel is below the level
        level = float(np.ceil(level) - 1) if self.detection.dark else level
        return int(cv2.countNonZero(cv2.threshold(sample.luma, level, 1, kind)[1]))

    def _take(self, block: Rows, who: Ints, seen: Seen, clear: NDArray[np.bool_], taken: int) -> None:
        """Write what was plainly seen in the first `taken` samples."""
        good = clear[:taken]
        for values, column in zip(seen[:8], block[:8], strict=True):
            column[:taken, who] = np.where(good, values[:taken], np.nan)
        block.flag[:taken, who] = np.where(
            good, np.where(seen.saturated[:taken], SATURATED, 0), block.flag[:taken, who]
        )
        self._learn(who, seen, clear, taken)

    def _learn(self, who: Ints, seen: Seen, clear: NDArray[np.bool_], taken: int) -> None:
        """Let the looks of the targets follow what the light and their distance do."""
        good = clear[:taken]
        count = good.sum(axis=0)
        some = np.flatnonzero(count)
        share = 1 - (1 - FOLLOW) ** count[some]
        for mine, values in (
            (self.pixels, seen.pixels),
            (self.contrast, seen.contrast),
            (self.background, seen.background),
            (self.size[:, 0], seen.width),
            (self.size[:, 1], seen.height),
        ):
            mean = np.where(good, values[:taken], 0).sum(axis=0)[some] / count[some]
            old = mine[who[some]]
            mine[who[some]] = np.where(np.isfinite(old), old + share * (mean - old), mean)

    def _remember(self, who: Ints, seen: Seen | None, clear: NDArray[np.bool_], times: Array, taken: int) -> None:
        fresh = np.full((taken, len(self.missing), 2), np.nan)
        if seen is not None:
            fresh[:, who, 0] = np.where(clear[:taken], seen.x[:taken], np.nan)
            fresh[:, who, 1] = np.where(clear[:taken], seen.y[:taken], np.nan)
        lost = ~np.isfinite(fresh[..., 0]).any(axis=0)
        kept = np.concatenate([self.known, fresh])[-MEMORY:]
        self.times = np.concatenate([self.times, times[:taken]])[-MEMORY:]
        # A lost target keeps its last memory: shift it in time rather than let it run out.
        gone = lost & ~np.isfinite(kept[..., 0]).any(axis=0)
        if gone.any():
            kept[0, gone] = self._last_known(gone)
        self.known = kept

    def _last_known(self, gone: NDArray[np.bool_]) -> Array:
        """The last position, px, of targets about to be forgotten, so that their boxes stay."""
        known = self.known[:, gone]
        seen = np.isfinite(known[..., 0])
        newest = seen.shape[0] - 1 - np.argmax(seen[::-1], axis=0)
        last: Array = known[newest, np.arange(known.shape[1])]
        return np.where(np.isfinite(last), last, self.starts.position[gone])

    def _not_clutter(self, seen: Seen) -> NDArray[np.bool_]:
        """Clear, and not one of the things that stood still from the beginning."""
        if self.clutter is None:
            return seen.clear
        c = self.clutter
        same = (np.abs(seen.x[..., None] - c.Xf) < 1.5) & (np.abs(seen.y[..., None] - c.Yf) < 1.5)
        return seen.clear & ~same.any(axis=-1)

    def _skip(self, sample: Sample) -> None:
        """A damaged picture: whatever it shows is no measurement."""
        block = self._blank([sample], np.array([sample.time]))
        block.flag[:] = CORRUPT | PREDICTED
        self._remember(np.arange(0), None, np.zeros((1, 0), bool), np.array([sample.time]), 1)
        self.blocks.append(block)
        self.done += 1

    def _mend(self, sample: Sample, who: Ints, block: Rows, j: int) -> None:
        """Seek the targets `who` in row j: in their boxes, then in the whole picture; say what became of the rest."""
        # The memory already holds this sample, empty for those that were not clear.
        predicted = self._predicted(who, np.array([sample.time]))[0]
        late = self.missing[who] - 1
        grown = self.starts.box[who] * (1 + 0.5 * np.minimum(late, 4))[:, None]
        boxes = np.concatenate([predicted - grown / 2, grown], axis=1)
        near = blobs_near(sample, self.detection, boxes, self._levels(who))
        cost = self._cost(who, predicted, near, block, j)
        reach = np.hypot(*(grown / 2).T)[:, None]
        off = np.hypot(near.Xf - predicted[:, :1], near.Yf - predicted[:, 1:])
        chosen = one_to_one(np.where(off < reach, cost + off / reach, np.inf))
        self._found(sample, who, near, chosen, block, j)
        left = np.flatnonzero(chosen < 0)
        if left.size:
            self._explain(sample, who[left], predicted[left], near, block, j)
            self._far(sample, who[left], block, j)

    def _cost(self, who: Ints, predicted: Array, blobs: Blobs, block: Rows, j: int) -> Array:
        """Unlikeness of blobs to targets, inf for what cannot be: clutter, cut by the edge, taken by another."""
        cost = unlikeness(blobs, self.pixels[who], self.contrast[who])
        # A target that nobody has seen yet is the most massive blob near the middle of its box.
        unseen = ~np.isfinite(self.pixels[who])
        if unseen.any() and blobs.Xf.size:
            cost[unseen] = 3 * (1 - np.log1p(np.maximum(blobs.mass, 0)) / np.log1p(max(blobs.mass.max(), 1.0)))
        bad = blobs.edge | (blobs.pixels < self.detection.min_pixels) | ~np.isfinite(blobs.Xf)
        others = np.isfinite(block.x[j])
        for x, y in ((block.x[j, others], block.y[j, others]), self._clutter_positions()):
            if x.size:
                bad = bad | (np.hypot(blobs.Xf[:, None] - x, blobs.Yf[:, None] - y) < 2).any(axis=1)
        cost[:, bad] = np.inf
        return cost

    def _clutter_positions(self) -> tuple[Array, Array]:
        if self.clutter is None:
            return np.empty(0), np.empty(0)
        return self.clutter.Xf, self.clutter.Yf

    def _found(self, sample: Sample, who: Ints, blobs: Blobs, chosen: Ints, block: Rows, j: int) -> None:
        """Write the blobs that were given to targets, and go on from there."""
        got, b = who[chosen >= 0], chosen[chosen >= 0]
        if not got.size:
            return
        contrast = contrast_of(blobs)[b]
        for column, values in zip(
            block[:7], (blobs.Xf, blobs.Yf, blobs.sd_x, blobs.sd_y, blobs.pixels, blobs.mass), strict=False
        ):
            column[j, got] = values[b]
        block.contrast[j, got] = contrast
        first = ~np.isfinite(self.pixels[got])
        again = (self.missing[got] > 1) & ~first
        block.flag[j, got] = np.where(again, RECOVERED, 0) | np.where(blobs.saturated[b], SATURATED, 0)
        self.pixels[got] = blobs.pixels[b]
        self.contrast[got] = contrast
        self.size[got] = np.stack([blobs.width[b], blobs.height[b]], axis=1)
        unknown = ~np.isfinite(self.background[got])
        self.background[got] = np.where(unknown, self._local_background(sample, blobs, b), self.background[got])
        self.known[-1, got] = np.stack([blobs.Xf[b], blobs.Yf[b]], axis=1)
        self.missing[got] = 0
        self.pending[got] = np.nan
        self._keep_crops(sample, got[again], block, j)

    def _local_background(self, sample: Sample, blobs: Blobs, b: Ints) -> Array:
        """Grey level beside blobs: the lower quarter of the pixels in a box twice as large."""
        levels = np.empty(b.size)
        rows, columns = sample.luma.shape
        top = sample.row(blobs.top.astype(float))
        for i, one in enumerate(b):
            w, h = int(blobs.width[one]), int(blobs.height[one])
            y, x = int(top[one]), int(blobs.left[one])
            piece = sample.luma[max(0, y - h) : min(rows, y + 2 * h), max(0, x - w) : min(columns, x + 2 * w)]
            levels[i] = np.percentile(self.detection.bright(piece), 25) * self.detection.scale
        return levels

    def _explain(self, sample: Sample, who: Ints, predicted: Array, near: Blobs, block: Rows, j: int) -> None:
        """Why a target was not measured: merged, cut by the picture's edge, too small; or simply lost."""
        over = within(near, predicted, sample.lines)
        large = near.pixels[None] > 1.5 * np.nan_to_num(self.pixels[who], nan=np.inf)[:, None]
        why = np.where((over & near.edge).any(axis=1), EDGE, 0)
        why = np.where((over & large & ~near.edge).any(axis=1), MERGED, why)
        others = np.flatnonzero(np.isfinite(block.x[j]))
        if others.size:
            close = (
                np.abs(predicted[:, None] - np.stack([block.x[j, others], block.y[j, others]], -1)) < self.size[others]
            )
            why = np.where((why == 0) & close.all(-1).any(1), MERGED, why)
        tiny = over & (near.pixels < self.detection.min_pixels)
        why = np.where((why == 0) & tiny.any(axis=1), SMALL, why)
        block.flag[j, who] = np.where(why > 0, why | PREDICTED, LOST | PREDICTED)
        self._keep_crops(sample, who[self.missing[who] == 1], block, j)

    def _far(self, sample: Sample, who: Ints, block: Rows, j: int) -> None:
        """Seek targets in the whole picture; one is taken when it is seen in two searches running."""
        who = who[(self.missing[who] > 1) & np.isfinite(self.pixels[who])] if self.far else who[:0]
        if not who.size:
            return
        level = self.detection.level
        if level is None and (self.missing[who] <= PATIENCE).any():  # later, the light may have changed meanwhile
            level = float(np.median(self._levels(who)))
        blobs = blobs_of(sample, self.detection, level)
        cost = self._cost(who, self.starts.position[who], blobs, block, j)
        waited = sample.time - self.pending[who, 2]
        reach = np.hypot(*self.starts.box[who].T) * np.clip(waited, 1, REACH)
        off = np.hypot(blobs.Xf - self.pending[who, :1], blobs.Yf - self.pending[who, 1:2])
        expected = np.isfinite(waited)
        sure = np.where(expected[:, None] & (off < reach[:, None]), cost + off / reach[:, None], np.inf)
        chosen = one_to_one(sure)
        before = self.pending[who]
        self._found(sample, who, blobs, chosen, block, j)
        back = np.flatnonzero(chosen >= 0)
        self._restart(who[back], before[back], sample.time)
        rest = np.flatnonzero(chosen < 0)
        cost[:, chosen[chosen >= 0]] = np.inf
        maybe = one_to_one(cost[rest])
        hope = rest[maybe >= 0]
        self.pending[who[rest]] = np.nan
        b = maybe[maybe >= 0]
        self.pending[who[hope]] = np.stack([blobs.Xf[b], blobs.Yf[b], np.full(b.size, sample.time)], axis=1)

    def _restart(self, who: Ints, before: Array, time: float) -> None:
        """Forget where they were going; go on from the two sightings."""
        now = self.known[-1, who].copy()
        self.known[:, who] = np.nan
        self.known[-1, who] = now
        if len(who) and len(self.times) > 1:
            step = (time - before[:, 2])[:, None]
            slope = (now - before[:, :2]) / np.maximum(step, 1e-6)
            self.known[-2, who] = now - slope * (time - self.times[-2])

    def _keep_crops(self, sample: Sample, who: Ints, block: Rows, j: int) -> None:
        """Keep what the box showed at a bad moment, at most three times a target."""
        rows, columns = sample.luma.shape
        for i in who:
            if len(self.crops) >= CROPS or sum(crop.target == i for crop in self.crops) >= 3:
                continue
            if not np.isfinite(block.box_x[j, i]):
                continue
            w, h = self.starts.box[i]
            left = int(np.clip(block.box_x[j, i], 0, max(columns - w, 0)))
            top = int(np.clip((block.box_y[j, i] - sample.parity) / sample.lines, 0, max(rows - h / sample.lines, 0)))
            piece = sample.luma[top : top + int(np.ceil(h / sample.lines)), left : left + int(np.ceil(w))]
            grey = np.clip(np.rint(piece * self.detection.scale), 0, 255).astype(np.uint8)
            self.crops.append(Crop(self.done + j, int(i), int(block.flag[j, i]), grey))
