"""Occlusion: while targets hide each other none of them is measured; afterwards their courses distinguish them.

What two targets that touch show is one blob, or one target and a part of the other. So from the moment in which
either is not plainly itself each is expected where its own course takes it, a smooth curve through its last positions:
few of them, as waves bend a course within a quarter of a second. Where the pixels allow it they are fitted together
(`separation`), else they are measured again once there are as many separate blobs as targets, given to them by least
squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.following.prediction import MOTION


@dataclass(frozen=True)
class Occlusion:
    """When targets count as hiding each other, and how their courses are continued.

    touching_px        between the boxes of two targets, below which they may be one blob
    inside             of a target's size: two centroids nearer than this to each other are of one and the same blob
    remembered         samples of a course, at most; course_lengths: those that are tried
    course_noise_px, course_acceleration_px  (a sample^2) # ASSUME: how well positions fit a course that is followed
                       through an occlusion; both are smaller than those of a prediction for the next sample (`MOTION`),
                       because more samples are bridged
    bending            samples for which an acceleration is taken to last
    tried, tests       samples ahead, and how many times, that a course is tried on what is known: a wave bends it by a
                       px, a ball that is thrown about by ten, and the error grows as the square of the time
    known              positions that a course needs to be tried
    astray_px          at most so far from its course is a target sought
    parting_px         between targets within which they are still sought together
    lasting            positions that are known of another track that is fitted with a target: glitter lasts for fewer
    off_way_px         by which a target may be first measured beside that way
    begun              positions, below which the way on which a target came to its first sample says more of its course
    """

    touching_px: float = 2.0
    inside: float = 0.5
    remembered: int = 20
    course_lengths: tuple[int, ...] = (20, 12, 8, 6, 4)
    course_noise_px: float = 0.1
    course_acceleration_px: float = 3.0
    bending: float = 5.0
    tried: int = 2
    tests: int = 3
    known: int = 4
    astray_px: float = 60.0
    parting_px: float = 4.0
    lasting: int = 6
    off_way_px: float = 4.0
    begun: int = 3


OCCLUSION = Occlusion()


class Occlusions:
    """Which of n targets hide each other, and the course of each: position, velocity and acceleration when it began."""

    def __init__(self, n: int) -> None:
        self.met = np.zeros(n, bool)
        self.waited = np.zeros(n, np.intp)
        self._course = np.zeros((3, n, 2))
        self._begun = np.zeros(n)
        self._unsteady, self._on_its_way = np.zeros(n), np.zeros(n, bool)
        self._history: dict[int, tuple[Array, Array]] = {}

    def begin(self, who: Ints, times: Array, positions: Array, ways: tuple[Array, Array] | None = None) -> None:
        """Targets `who` touch after the samples at `times` (m,), positions (m, n, 2) px.

        ways  the same with the ways on which targets came to their first sample: they count while they say more
        """
        for i in who[~self.met[who]].tolist():
            history = _known(i, times, positions)
            if ways is not None and history[0].size < OCCLUSION.begun <= (way := _known(i, *ways))[0].size:
                history, self._on_its_way[i] = way, True
            else:
                self._on_its_way[i] = False
            if not history[0].size:
                continue
            self._history[i] = history
            self._continue(i)
            self._unsteady[i] = _unsteady(*self._history[i])
            self.met[i] = True
            self.waited[i] = 0

    def end(self, who: Ints) -> None:
        """These targets are apart again."""
        self.met[who] = False

    def at(self, who: Ints, times: Array) -> Array:
        """Where the courses of targets are at times (k,), (k, len(who), 2) px."""
        t = times[:, None, None] - self._begun[who][:, None]
        bent = np.minimum(t, OCCLUSION.bending)
        p, v, a = self._course[:, who]
        where: Array = p + v * t + a * bent * (t - bent / 2)
        return where

    def velocity(self, who: Ints, time: float) -> Array:
        """Velocities (len(who), 2), px a sample."""
        _, v, a = self._course[:, who]
        lasting = np.minimum(time - self._begun[who], OCCLUSION.bending)
        return np.asarray(v + a * lasting[:, None])

    def astray(self, who: Ints, time: float) -> Array:
        """How far (len(who),), px, targets may be from their courses by now, as these were wrong before."""
        gone = np.maximum(time - self._begun[who], 0) / OCCLUSION.tried
        return np.asarray(np.minimum(self._unsteady[who] * gone**2, OCCLUSION.astray_px))

    def with_targets(self, who: Ints, n: int, time: float, place: Array, size: Array) -> Bools:
        """Which of the places `who` (m,) hide one of the first n, or are hidden by it: they are measured by one fit.

        place, size  (m, 2) px, where each is expected, and its width and height
        """
        out = np.zeros(who.size, bool)
        lasts = [self.met[i] and (i < n or self._history[i][0].size >= OCCLUSION.lasting) for i in who.tolist()]
        met = np.flatnonzero(lasts)
        targets = who[met] < n
        if targets.all() or not targets.any():
            return out
        astray = self.astray(who[met], time)[:, None]
        for group in groups(place[met], size[met] + astray, OCCLUSION.parting_px):
            out[met[group]] = targets[group].any()
        return out

    def wait(self, who: Ints, most: int) -> None:
        """One more sample in which nothing shows these targets; after `most` they are no longer waited for."""
        self.waited[who] += 1
        self.end(who[self.waited[who] > most])

    def seen(self, who: Ints, time: float, position: Array) -> None:
        """These targets are measured at positions (m, 2) px although they hide each other; courses go on there."""
        for i, now in zip(who.tolist(), position, strict=True):
            times, positions = self._history[i]
            off = np.hypot(*(now - self.at(np.array([i]), np.array([time]))[0, 0]))
            if self._on_its_way[i] and off > OCCLUSION.off_way_px:  # what led to its first sample was another thing
                times, positions = times[:0], positions[:0]
            self._on_its_way[i] = False
            keep = slice(-OCCLUSION.remembered, None)
            self._history[i] = np.append(times, time)[keep], np.concatenate([positions, now[None]])[keep]
            self._continue(i)
        self.waited[who] = 0

    def _continue(self, i: int) -> None:
        """The course of one target by its last positions."""
        times, positions = self._history[i]
        self._course[:, i] = _course(times - times[-1], positions)
        self._begun[i] = times[-1]

    def shift(self, who: Ints, by: Array) -> None:
        """Move the courses of targets that are seen as one blob by (2,) px."""
        self._course[0, who] += by


def _known(i: int, times: Array, positions: Array) -> tuple[Array, Array]:
    """When and where one of n targets was measured last, of times (m,), positions (m, n, 2) px."""
    if not times.size:
        return np.zeros(0), np.zeros((0, 2))
    known = np.flatnonzero(np.isfinite(positions[:, i, 0]))[-OCCLUSION.remembered :]
    return times[known], positions[known, i]


def _unsteady(times: Array, positions: Array) -> float:
    """How far off, px, courses of before were after OCCLUSION.tried samples, the most of some; 0: not known."""
    off = [0.0]
    end = len(times) - OCCLUSION.tried + 1
    for last in range(end - OCCLUSION.tests, end):
        if last >= OCCLUSION.known:
            gone = times[last + OCCLUSION.tried - 1] - times[last - 1]
            p, v, a = _course(times[:last] - times[last - 1], positions[:last])
            miss = p + v * gone + a * gone * gone / 2 - positions[last + OCCLUSION.tried - 1]
            off.append(float(np.hypot(*miss)) * (OCCLUSION.tried / gone) ** 2)
    return max(off)


def _course(back: Array, positions: Array) -> Array:
    """Position, velocity and acceleration (3, 2) at time 0 of a parabola through positions (m, 2) at times `back`.

    Through as many of the last ones as a parabola fits: waves bend it within a few samples, slow courses are known the
    better the longer.
    """
    noise, speed, acceleration = OCCLUSION.course_noise_px, MOTION.speed_px, OCCLUSION.course_acceleration_px
    ridge = np.diag([1e-9, (noise / speed) ** 2, (noise / acceleration) ** 2])
    course: Array = np.zeros((3, 2))
    for most in OCCLUSION.course_lengths:
        t, p = back[-most:], positions[-most:]
        A = np.stack([np.ones_like(t), t, t * t / 2], axis=1)
        course = np.asarray(np.linalg.solve(A.T @ A + ridge, A.T @ p), float)
        if np.sqrt(np.square(p - A @ course).mean()) < noise:
            break
    return course


def cleared(clear: Bools, position: Array, size: Array) -> Bools:
    """Which targets (k, n) are clear also of each other: where two touch, neither is unless both are; and neither where
    both centroids are of one blob.

    clear (k, n); position (k, n, 2) px: measured where clear, else expected; size (n, 2) px
    """
    one, other = _close(position, size)
    if not one.size:
        return clear
    apart = np.abs(position[:, one] - position[:, other])
    both = (size[one] + size[other]) / 2
    touching, same = (
        np.asarray((apart < reach).all(axis=-1)) for reach in (both + OCCLUSION.touching_px, OCCLUSION.inside * both)
    )
    before, clear = clear, clear.copy()
    for pair in np.flatnonzero(touching.any(axis=0)):
        i, j = one[pair], other[pair]
        clear[:, i] &= ~(touching[:, pair] & ~before[:, j] | same[:, pair])
        clear[:, j] &= ~(touching[:, pair] & ~before[:, i] | same[:, pair])
    return clear


def _close(position: Array, size: Array) -> tuple[Ints, Ints]:
    """Pairs of targets whose boxes, grown by OCCLUSION.touching_px between them, meet in any of k samples.

    A sweep from left to right: of all targets, only those that overlap across are compared down the picture.
    """
    margin = (size + OCCLUSION.touching_px) / 2
    position = np.ascontiguousarray(position)  # reduced in a tenth of the time
    low, high = position.min(axis=0) - margin, position.max(axis=0) + margin
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    place = np.arange(len(order))
    count = np.maximum(np.searchsorted(low[:, 0], high[:, 0]) - place - 1, 0)
    one = np.repeat(place, count)
    other = np.arange(one.size) - np.repeat(np.cumsum(count) - count, count) + one + 1
    meet = (low[one, 1] < high[other, 1]) & (low[other, 1] < high[one, 1])
    return order[one[meet]], order[other[meet]]


def _touching(position: Array, size: Array) -> tuple[Bools, Bools]:
    """Pairs (n, n) whose boxes touch, and pairs whose middles lie in each other; no target is a pair with itself."""
    apart = np.abs(position[:, None] - position)
    both = (size[:, None] + size) / 2
    others = ~np.eye(len(position), dtype=bool)
    touching, same = ((apart < reach).all(axis=-1) for reach in (both + OCCLUSION.touching_px, OCCLUSION.inside * both))
    return touching & others, same & others


def touched(position: Array, size: Array) -> Bools:
    """Which targets (n,) touch another one; position and size (n, 2) px."""
    return np.asarray(_touching(position, size)[0].any(axis=1))


def groups(position: Array, size: Array, slack: float) -> list[Ints]:
    """Targets joined to groups whose boxes come within `slack` px of one another's; position and size (n, 2) px."""
    apart = np.abs(position[:, None] - position) - (size[:, None] + size) / 2
    near = (apart < slack).all(axis=-1)
    label = np.arange(len(position))
    for _ in range(len(position)):
        least = np.where(near, label, len(position)).min(axis=1)
        if (least == label).all():
            break
        label = least
    return [np.flatnonzero(label == one) for one in np.unique(label)]


def distinct(cost: Array, chosen: Ints) -> bool:
    """Whether of two targets each is nearer to its own blob than, by a px or two, if they changed places."""
    own, swapped = (sum(float(cost[i, j]) for i, j in enumerate(order)) for order in (chosen, chosen[::-1]))
    return len(cost) != 2 or swapped > own + 4.0


def recent(times: Sequence[Array], positions: Sequence[Array]) -> tuple[Array, Array]:
    """The last OCCLUSION.remembered samples of pieces of a recording: times (k,) and positions (2, k, n) each."""
    t, p, count = [], [], 0
    for time, piece in zip(reversed(times), reversed(positions), strict=True):
        t.append(time)
        p.append(piece.transpose(1, 2, 0))
        count += time.size
        if count >= OCCLUSION.remembered:
            break
    return np.concatenate(t[::-1])[-OCCLUSION.remembered :], np.concatenate(p[::-1])[-OCCLUSION.remembered :]
