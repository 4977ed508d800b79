"""Where targets begin, for the tracker: in start boxes, on trails of the opening, before them, or later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.initialisation import find_movers
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.settings import Detection
from vidtrack.tracking.state import MEMORY, RECOVERED, Rows, Starts
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.trails import SHORTEST, Trail

NEVER = 1 << 60
"""The first sample of a target that has not been seen yet."""


def starts_in_boxes(boxes: Array) -> Starts:
    """Starts in boxes (n, 4), middle, width and height, px: nothing else is known yet."""
    n = len(boxes)
    unknown = np.full(n, np.nan)
    return Starts(
        boxes[:, :2].copy(),
        np.full((n, 2), np.nan),
        np.full((n, 2), np.nan),
        boxes[:, 2:].copy(),
        np.zeros(n, np.intp),
        unknown,
        unknown,
        unknown,
        np.full((n, 2), np.nan),
    )


def starts_of_trails(trails: Sequence[Trail], n: int, box: tuple[float, float]) -> Starts:
    """Starts of the trails, then of those that have not been seen yet."""
    unknown = np.full(n, np.nan)
    starts = Starts(
        np.full((n, 2), np.nan),
        np.full((n, 2), np.nan),
        np.full((n, 2), np.nan),
        np.tile(np.asarray(box, float), (n, 1)),
        np.full(n, NEVER, np.intp),
        unknown.copy(),
        unknown.copy(),
        unknown.copy(),
        np.full((n, 2), np.nan),
    )
    for i, trail in enumerate(trails):
        starts.position[i], starts.first[i] = trail.position[0], trail.sample[0]
    where = np.array([trail.position[:3] for trail in trails if len(trail.sample) > 2]).reshape(-1, 3, 2)
    if len(where):
        long = np.array([i for i, trail in enumerate(trails) if len(trail.sample) > 2])
        t1, t2 = np.array([trail.sample[1:3] - trail.sample[0] for trail in trails if len(trail.sample) > 2], float).T
        # the parabola through three positions, by divided differences
        first, second = (where[:, 1] - where[:, 0]) / t1[:, None], (where[:, 2] - where[:, 1]) / (t2 - t1)[:, None]
        bend = (second - first) / t2[:, None]
        starts.velocity[long], starts.acceleration[long] = first - bend * t1[:, None], 2 * bend
    for length in {len(trail.sample) for trail in trails}:
        alike = [i for i, trail in enumerate(trails) if len(trail.sample) == length]
        looks = np.array([[trails[i].pixels, trails[i].contrast, *trails[i].size.T] for i in alike])
        # where it hardly moved at first, its own place in the background hides part of it
        starts.pixels[alike], starts.contrast[alike], *size = np.percentile(looks, 75, axis=2).T
        starts.size[alike] = np.stack(size, axis=1)
    return starts


def followed_backwards(
    samples: Sequence[Sample], starts: Starts, detection: Detection, level: float, static: StaticClutter | None
) -> list[tuple[int, Rows]]:
    """What the samples before a target's own first one show, followed backwards in time: (target, rows in order)."""
    followed = []
    for i in np.flatnonzero((starts.first > 0) & (starts.first < NEVER)):
        before = list(reversed(samples[: starts.first[i]]))
        last = samples[starts.first[i]].time
        one = Starts._make(column[i : i + 1].copy() for column in starts)
        gone = last - before[0].time
        one = one._replace(
            position=one.position - one.velocity * gone, velocity=-one.velocity, first=np.zeros(1, np.intp)
        )
        back = Tracker(one, detection, level, static=static, far=False)
        back.follow([sample._replace(time=last - sample.time) for sample in before])
        back.finish()
        rows = back.rows()
        followed.append((int(i), Rows(rows.values[:, ::-1], rows.corner[::-1], rows.flag[::-1], rows.total_pixels)))
    return followed


def with_earlier(rows: Rows, earlier: list[tuple[int, Rows]]) -> Rows:
    """The rows with what was followed backwards."""
    values, corner, flag = rows.values.copy(), rows.corner.copy(), rows.flag.copy()
    for i, before in earlier:
        k = len(before.flag)
        values[:, :k, i] = before.values[..., 0]
        corner[:k, i] = before.corner[:, 0]
        flag[:k, i] = before.flag[:, 0] & ~RECOVERED
    return Rows(values, corner, flag, rows.total_pixels)


def late_comers(
    tracker: Tracker,
    samples: Sequence[Sample],
    backgrounds: Mapping[int, NDArray[Any]],
    detection: Detection,
    waiting: list[int],
) -> list[int]:
    """Give trails that began in these samples to targets that have not been seen yet; returns which still wait."""
    samples = samples[-MEMORY:]
    known = tracker.state.positions[-len(samples) :]
    if len(samples) < SHORTEST:
        return waiting
    for trail in find_movers(samples, backgrounds, detection, len(waiting)):
        if not waiting:
            break
        apart = known[trail.sample] - trail.position[:, None]
        if trail.sample[-1] < len(samples) - 2 or (np.hypot(apart[..., 0], apart[..., 1]) < 5).any():
            continue
        times = np.array([samples[j].time for j in trail.sample])
        looks = [float(trail.pixels[-1]), float(trail.contrast[-1]), np.nan, *trail.size[-1].tolist()]
        tracker.begin(waiting.pop(0), trail.position, times, looks)
    return waiting
