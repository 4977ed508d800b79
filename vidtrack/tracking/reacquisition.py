"""Lost targets sought again: in their boxes first, then in the whole picture; and why one was not measured.

Blobs are given to targets one to one, by where each should be and how alike it is to what it looked like. Outside
of its box a target is taken only where two searches running find it. What cannot be told apart stays missing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.association.assignment import one_to_one
from vidtrack.tracking.association.occlusion import PATIENCE, groups
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.candidates import blobs_near, blobs_of, contrast_of, unlikeness, within
from vidtrack.tracking.measurement.window import GRAIN
from vidtrack.tracking.sample import Sample

if TYPE_CHECKING:
    from vidtrack.tracking.tracker import Rows, Tracker


LOST, RECOVERED, PREDICTED, EDGE, SATURATED, MERGED, SMALL, CORRUPT = (1 << bit for bit in range(8))
FLAGS = ("lost", "recovered", "predicted", "edge", "saturated", "merged", "small", "corrupt")
"""The words of the flags, by bit."""

MANY = 4
"""More targets than this are sought in the whole picture at once rather than box by box."""
IMPATIENT = 10
"""Samples after which the light may have changed: the threshold is then set anew."""
UNSTEADY = 5.0
"""px a sample by which a lost target may turn out faster than it was."""
FARTHEST = 8.0
"""Samples between two sightings that still vouch for each other."""
WHOLE = 0.35
"""|log| of the ratio of pixel counts up to which a blob is one whole target after a meeting, neither two nor a part."""
ABOVE_EDGES = 1.5
"""Of a target's half contrast: a level above all that two soft edges which nearly touch add up to."""
TWO = 1.4
"""Of a target's pixels: a blob of more is several targets."""
PARTING = 4.0
"""px between targets within which they are still sought together."""
CROPS = 12
"""Pieces of pictures kept to show the worst moments; three a target at most."""


class Crop(NamedTuple):
    """A piece of a picture at a bad moment: (rows, columns) of the sample, its number, the target and the flag."""

    sample: int
    target: int
    flag: int
    picture: NDArray[np.uint8]


class Recovery:
    """What the tracker does about targets that it does not plainly see."""

    def __init__(self, tracker: Tracker, *, far: bool) -> None:
        self.tracker, self.far = tracker, far
        self.pending = np.full((len(tracker.starts.first), 3), np.nan)  # x, y, time of a first sighting far away
        self.crops: list[Crop] = []

    def seek(self, sample: Sample, who: Ints, predicted: Array, block: Rows, j: int) -> None:
        """Seek the targets `who`, predicted (n, 2) px, in a sample that is row j of the block, and write it."""
        tracker = self.tracker
        met = tracker.meetings.met[who]
        if met.any():
            self._seek_met(sample, who[met], predicted[who[met]], block, j)
            who = who[~met]
        if not who.size:
            return
        predicted = predicted[who]
        grown = tracker.starts.box[who] * (1 + 0.5 * np.minimum(tracker.missing[who] - 1, 4))[:, None]
        if who.size > MANY:
            near = blobs_of(sample, tracker.detection, float(np.median(tracker.levels(who))))
        else:
            boxes = np.concatenate([predicted - grown / 2, grown], axis=1)
            near = blobs_near(sample, tracker.detection, boxes, tracker.levels(who))
        chosen = self._seek_near(sample, who, predicted, grown, near, block, j)
        left = np.flatnonzero(chosen < 0)
        if left.size:
            self._explain(sample, who[left], predicted[left], near, block, j)
        if tracker.detection.level is None and 0 < left.size <= MANY:  # the light may have changed
            alone = left[(block.flag[j, who[left]] & (MERGED | EDGE) == 0) & np.isfinite(tracker.looks[0, who[left]])]
            if alone.size:
                boxes = np.concatenate([predicted - grown / 2, grown], axis=1)[alone]
                levels = _own_levels(sample, boxes, who[alone], tracker)
                near = blobs_near(sample, tracker.detection, boxes, levels)
                chosen[alone] = self._seek_near(sample, who[alone], predicted[alone], grown[alone], near, block, j)
                left = np.flatnonzero(chosen < 0)
        if left.size:
            self._seek_far(sample, who[left], predicted[left], block, j)

    def _seek_near(
        self, sample: Sample, who: Ints, predicted: Array, grown: Array, near: Blobs, block: Rows, j: int
    ) -> Ints:
        """Which blobs are the targets, within their grown boxes (n, 2) px; -1: none. They are written."""
        off = np.stack([near.Xf, near.Yf], axis=-1) - predicted[:, None]
        inside = (np.abs(off) <= grown[:, None] / 2).all(axis=-1)
        off = np.hypot(off[..., 0], off[..., 1]) / np.hypot(*(grown / 2).T)[:, None]
        claimed = within(near, predicted, sample.lines, slack=0.0).sum(axis=0) > 1  # one blob where two should be
        cost = self._cost(sample, who, near, block, j) + off
        chosen = one_to_one(np.where(inside & ~claimed, cost, np.inf))
        self._found(sample, who, near, chosen, block, j)
        return chosen

    def _seek_met(self, sample: Sample, who: Ints, predicted: Array, block: Rows, j: int) -> None:
        """Seek targets that have met, predicted (n, 2) px by their courses: all of a group, or none of it."""
        tracker = self.tracker
        size = tracker.sizes(who, sample.lines)
        for group in groups(predicted, size, PARTING):
            some, middle = who[group], predicted[group]
            # how far from its course a target may have got: as far as it is large, and more with time
            reach = size[group].max(axis=1) / 2 + 2 + 0.5 * tracker.missing[some]
            half = tracker.starts.box[some] / 2 + reach[:, None]
            low, high = (middle - half).min(axis=0), (middle + half).max(axis=0)
            box = np.concatenate([low, high - low])[None]
            level = np.array([np.median(tracker.levels(some))])
            whole = blobs_near(sample, tracker.detection, box, level)
            if self._parted(sample, some, middle, reach, whole, block, j):
                continue
            if tracker.detection.level is None:  # soft edges that meet are one blob at the usual level
                level = level + (ABOVE_EDGES - 1) * (level - np.median(tracker.looks[2, some]))
                tops = blobs_near(sample, tracker.detection, box, level)
                looks = tracker.looks[:, some]
                if self._parted(sample, some, middle, reach, tops, block, j):
                    tracker.looks[:, some] = looks  # what is above this level is less than the targets
                    continue
            self._still_met(sample, some, middle, whole, block, j)

    def _parted(
        self, sample: Sample, who: Ints, predicted: Array, reach: Array, near: Blobs, block: Rows, j: int
    ) -> bool:
        """Whether there is a blob for each target that has met, within `reach` (n,) px; they are then written."""
        cost = self._cost(sample, who, near, block, j)
        pixels = self.tracker.looks[0, who, None]
        off = np.hypot(near.Xf - predicted[:, :1], near.Yf - predicted[:, 1:])
        alike = np.abs(np.log(near.pixels / pixels)) < WHOLE + GRAIN / pixels
        cost = np.where(np.isfinite(cost) & alike & (off < reach[:, None]), off**2, np.inf)
        chosen = one_to_one(cost)
        if (chosen < 0).any() or not _told_apart(cost, chosen):
            return False
        before = self.tracker.meetings.velocity(who, sample.time)
        self._found(sample, who, near, chosen, block, j)
        self._go_on(who, before)
        return True

    def _still_met(self, sample: Sample, who: Ints, predicted: Array, near: Blobs, block: Rows, j: int) -> None:
        """Targets that cannot be told apart yet; where nothing shows that they are there, some day they are not."""
        tracker = self.tracker
        covering = within(near, predicted, sample.lines, slack=0.0)
        large = near.pixels > TWO * tracker.looks[0, who].max()
        block.flag[j, who] = MERGED | PREDICTED
        self._keep(sample, who[tracker.missing[who] == 1], block, j)
        if (covering & large).any():
            tracker.meetings.waited[who] = 0
            one = np.flatnonzero((covering & large & ~near.edge).all(axis=0))
            if who.size > 1 and one.size == 1:  # the blob of all of them: its middle is theirs
                weight = tracker.looks[0, who] / tracker.looks[0, who].sum()
                at = np.array([near.Xf[one[0]], near.Yf[one[0]]])
                tracker.meetings.shift(who, at - weight @ predicted)
            return
        tracker.meetings.waited[who] += 1
        tracker.meetings.end(who[tracker.meetings.waited[who] > (PATIENCE if who.size > 1 else FARTHEST)])

    def _go_on(self, who: Ints, velocity: Array) -> None:
        """Let targets that have parted go on at these velocities (n, 2), px a sample: what they did before is over."""
        known, times = self.tracker.known, self.tracker.times
        now = known[-1, who].copy()
        known[:, who] = np.nan
        known[-3:, who] = now + velocity * (times[-3:, None, None] - times[-1])
        self.tracker.meetings.end(who)

    def _cost(self, sample: Sample, who: Ints, blobs: Blobs, block: Rows, j: int) -> Array:
        """Unlikeness of blobs to targets, inf for what cannot be: cut by the edge, taken by another, touching what
        stands about.
        """
        tracker = self.tracker
        pixels, contrast = tracker.looks[:2, who]
        cost = unlikeness(blobs, pixels, contrast)
        unseen = ~np.isfinite(pixels)
        if unseen.any() and blobs.Xf.size:  # nobody has seen it yet: a massive blob near the middle of its box
            mass = np.log1p(np.maximum(blobs.mass, 0))
            cost[unseen] = 3 * (1 - mass / max(float(mass.max()), 1.0))
        bad = blobs.edge | (blobs.pixels < tracker.detection.min_pixels) | ~np.isfinite(blobs.Xf)
        taken = block.values[:2, j][:, np.isfinite(block.values[0, j])]
        for x, y in (taken, tracker.clutter):
            if x.size:
                bad = bad | (np.hypot(blobs.Xf[:, None] - x, blobs.Yf[:, None] - y) < 2).any(axis=1)
        if tracker.standing is not None and blobs.Xf.size:
            x, y = blobs.left + (blobs.width - 1) / 2, blobs.top + (blobs.height - 1) / 2 * sample.lines
            bad = bad | tracker.standing.touched([sample], x[None], y[None], blobs.width, blobs.height)[0]
        cost[:, bad] = np.inf
        return cost

    def _found(self, sample: Sample, who: Ints, blobs: Blobs, chosen: Ints, block: Rows, j: int) -> None:
        """Write the blobs that were given to targets; the tracker goes on from there."""
        tracker = self.tracker
        got, b = who[chosen >= 0], chosen[chosen >= 0]
        if not got.size:
            return
        first = ~np.isfinite(tracker.looks[0, got])
        again = (tracker.missing[got] > 1) & ~first
        contrast = contrast_of(blobs)[b]
        background, top = _beside(sample, blobs, b, tracker)
        position = np.stack([blobs.Xf[b], blobs.Yf[b]])
        block.values[:, j, got] = [
            *position, blobs.sd_x[b], blobs.sd_y[b], blobs.pixels[b], blobs.mass[b], contrast, background
        ]  # fmt: skip
        block.flag[j, got] = again * RECOVERED + blobs.saturated[b] * SATURATED
        block.corner[j, got] = position.T - tracker.starts.box[got] / 2
        tracker.looks[:5, got] = [blobs.pixels[b], contrast, background, blobs.width[b], blobs.height[b]]
        tracker.looks[7, got] = top - background
        tracker.known[-1, got] = position.T
        tracker.missing[got] = 0
        self.pending[got] = np.nan
        self._keep(sample, got[again], block, j)

    def _explain(self, sample: Sample, who: Ints, predicted: Array, near: Blobs, block: Rows, j: int) -> None:
        """Why targets were not measured: merged, cut by the picture's edge, too small; or simply lost."""
        tracker = self.tracker
        over = within(near, predicted, sample.lines)
        large = near.pixels > 1.5 * np.nan_to_num(tracker.looks[:1, who].T, nan=np.inf)
        why = np.where((over & near.edge).any(axis=1), EDGE, 0)
        shared = within(near, predicted, sample.lines, slack=0.0).sum(axis=0) > 1
        why = np.where((over & (large | shared) & ~near.edge).any(axis=1), MERGED, why)
        others = np.flatnonzero(np.isfinite(block.values[0, j]))
        if others.size:
            apart = np.abs(predicted[:, None] - block.values[:2, j, others].T)
            close = apart < tracker.looks[3:5, others].T * (1, sample.lines)
            why = np.where((why == 0) & np.all(close, axis=-1).any(axis=1), MERGED, why)
        if tracker.standing is not None:
            hidden = tracker.standing.touched([sample], *predicted.T[:, None], *tracker.looks[3:5, who])[0]
            why = np.where(hidden & (why == 0), MERGED, why)
        tiny = over & (near.pixels < tracker.detection.min_pixels)
        why = np.where((why == 0) & tiny.any(axis=1), SMALL, why)
        block.flag[j, who] = np.where(why > 0, why, LOST) | PREDICTED
        self._keep(sample, who[tracker.missing[who] == 1], block, j)

    def _within_reach(self, who: Ints, predicted: Array, blobs: Blobs) -> NDArray[np.bool_]:
        """Which blobs (n, m) targets may have come to since they were lost; anywhere after IMPATIENT samples, and
        while nobody knows yet how fast they are.
        """
        tracker = self.tracker
        seen = tracker.known[:, who]
        with np.errstate(invalid="ignore"):
            speed = np.nanmax(np.hypot(*np.moveaxis(np.diff(seen, axis=0), -1, 0)), axis=0, initial=-np.inf)
        gone = tracker.missing[who]
        reach = np.hypot(*tracker.starts.box[who].T) / 2 + (speed + UNSTEADY) * gone
        reach = np.where((gone > IMPATIENT) | ~np.isfinite(speed), np.inf, reach)
        off = np.hypot(blobs.Xf - predicted[:, :1], blobs.Yf - predicted[:, 1:])
        return np.asarray(off < reach[:, None])

    def _seek_far(self, sample: Sample, who: Ints, predicted: Array, block: Rows, j: int) -> None:
        """Seek targets in the whole picture."""
        tracker = self.tracker
        sought = (tracker.missing[who] > 1) & np.isfinite(tracker.looks[0, who]) & self.far
        sought &= block.flag[j, who] & MERGED == 0  # it is there, but cannot be told apart
        who, predicted = who[sought], predicted[sought]
        if not who.size:
            return
        level = tracker.detection.level
        if level is None and (tracker.missing[who] <= IMPATIENT).any():
            level = float(np.median(tracker.levels(who)))
        taken = block.values[:2, j][:, np.isfinite(block.values[0, j])]
        blobs = blobs_of(sample, tracker.detection, level, known=taken)
        cost = np.where(self._within_reach(who, predicted, blobs), self._cost(sample, who, blobs, block, j), np.inf)
        before = self.pending[who].copy()
        waited = sample.time - before[:, 2]
        reach = (np.hypot(*tracker.starts.box[who].T) * np.clip(waited, 1, FARTHEST))[:, None]
        off = np.hypot(blobs.Xf - before[:, :1], blobs.Yf - before[:, 1:2])
        sure = np.isfinite(waited)[:, None] & (off < reach)
        chosen = one_to_one(np.where(sure, cost + off / reach, np.inf))
        self._found(sample, who, blobs, chosen, block, j)
        self._restart(who[chosen >= 0], before[chosen >= 0], sample.time)
        rest = np.flatnonzero(chosen < 0)
        cost[:, chosen[chosen >= 0]] = np.inf
        maybe = one_to_one(cost[rest])
        b = maybe[maybe >= 0]
        self.pending[who[rest]] = np.nan
        self.pending[who[rest[maybe >= 0]]] = np.stack([blobs.Xf[b], blobs.Yf[b], np.full(b.size, sample.time)], axis=1)

    def _restart(self, who: Ints, before: Array, time: float) -> None:
        """Forget where targets were going; they go on from two sightings, before (n, 3): x, y, time."""
        if not who.size:
            return
        known, times = self.tracker.known, self.tracker.times
        now = known[-1, who]
        velocity = (now - before[:, :2]) / np.maximum(time - before[:, 2:], 1e-6)
        known[:, who] = np.nan
        known[-2:, who] = now + velocity * (times[-2:, None, None] - time)

    def _keep(self, sample: Sample, who: Ints, block: Rows, j: int) -> None:
        """Keep what the box showed at a bad moment."""
        tracker, (rows, columns) = self.tracker, sample.luma.shape
        for i in who.tolist():
            if len(self.crops) >= CROPS or sum(crop.target == i for crop in self.crops) >= 3:
                continue
            if not np.isfinite(block.corner[j, i]).all():
                continue
            wide, high = int(tracker.starts.box[i, 0]), int(np.ceil(tracker.starts.box[i, 1] / sample.lines))
            left = int(np.clip(block.corner[j, i, 0], 0, max(columns - wide, 0)))
            top = int(np.clip(sample.row(block.corner[j, i, 1]), 0, max(rows - high, 0)))
            piece = sample.luma[top : top + high, left : left + wide] * tracker.detection.scale
            flag = int(block.flag[j, i])
            self.crops.append(Crop(tracker.done + j, i, flag, np.clip(np.rint(piece), 0, 255).astype(np.uint8)))


def _told_apart(cost: Array, chosen: Ints) -> bool:
    """Whether of two targets each is nearer to its own blob than, by a px or two, if they changed places."""
    if len(cost) != 2:
        return True
    swapped = float(cost[0, chosen[1]] + cost[1, chosen[0]])
    return swapped > float(cost[0, chosen[0]] + cost[1, chosen[1]]) + 4.0


def _beside(sample: Sample, blobs: Blobs, which: Ints, tracker: Tracker) -> Array:
    """Grey levels beside and on some blobs, (2, n).

    Beside: the lower quarter of the pixels in a box three times as large; on: the mean of the brightest in their own
    boxes, as many as they have pixels.
    """
    levels = np.empty((2, which.size))
    rows, columns = sample.luma.shape
    top = np.rint(sample.row(blobs.top.astype(float))).astype(int)
    for i, b in enumerate(which):
        w, h, x, y = int(blobs.width[b]), int(blobs.height[b]), int(blobs.left[b]), int(top[b])
        piece = sample.luma[max(0, y - h) : min(rows, y + 2 * h), max(0, x - w) : min(columns, x + 2 * w)]
        rank = piece.size // 4
        levels[0, i] = np.partition(tracker.detection.bright(piece).ravel(), rank)[rank]
        own = tracker.detection.bright(sample.luma[y : y + h, x : x + w]).ravel()
        levels[1, i] = np.sort(own)[-int(blobs.pixels[b]) :].mean(dtype=float)
    return levels * tracker.detection.scale


def _own_levels(sample: Sample, boxes: Array, who: Ints, tracker: Tracker) -> Array:
    """Half-way, grey levels, from what is usual in boxes (n, 4: left, top, width, height, px) to as many of their
    brightest pixels as each target has; out of reach where nothing stands out of the noise.
    """
    levels = np.full(who.size, 1e3)
    rows, columns = sample.luma.shape
    for i, (x, y, w, h) in enumerate(boxes):
        left, right = (int(np.clip(v, 0, columns)) for v in (x, x + w))
        top, bottom = (int(np.clip(v, 0, rows)) for v in sample.row(np.array([y, y + h])))
        light = np.sort(tracker.detection.bright(sample.luma[top:bottom, left:right]), axis=None)
        n = int(tracker.looks[0, who[i]])
        if light.size < 4 * n:
            continue
        base, on = float(np.median(light)), float(light[-n:].mean())
        half = (on - base) / 2 * tracker.detection.scale
        if half > 4.5 * tracker.detection.noise:
            levels[i] = base * tracker.detection.scale + half
    return levels
