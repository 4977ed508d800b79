"""Trails: candidates of consecutive samples linked to each other, before any target is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.assignment import mutual_best
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.candidates import contrast_of
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Linking:
    """Which candidates make a trail, and which trails move.

    shortest  samples that a moving trail has at least: fewer could be chance
    jitters   of the variance of its places, the mean square of its steps: 2 where a thing is about one place at random,
              1.4 for what swings once in 5 samples, 1 and less for what goes on, though its fields alternate
    within    of its own size, a way of which such a trail is no motion: it may swing
    leaps     of the way, what is left without its largest step: less is a thing that leaps once, and no motion
    """

    shortest: int = 3
    jitters: float = 1.4
    within: float = 2.0
    leaps: float = 0.15


LINKING = Linking()


class Trail(NamedTuple):
    """Blobs of one thing: sample numbers (m,), positions (m, 2) px, pixels, contrast (m,), sizes (m, 2), fill (m,)."""

    sample: Ints
    position: Array
    pixels: Array
    contrast: Array
    size: Array
    fill: Array


def link(found: Sequence[Blobs], samples: Sequence[Sample], max_step: float) -> list[Trail]:
    """Blobs of consecutive samples joined to trails: nearest to where the trail heads, alike in size and contrast.

    max_step  share of the picture's diagonal that a target moves between samples, at most
    """
    rows, columns = samples[0].luma.shape
    leap = max_step * float(np.hypot(rows * samples[0].lines, columns))
    trails: list[list[tuple[int, int]]] = []
    alive: list[int] = []
    ends = np.zeros((0, 8))  # x, y, log pixels, log contrast and time of the last blob; x, y and time of the one before
    for j, blobs in enumerate(found):
        appearance = np.stack([blobs.Xf, blobs.Yf, np.log(blobs.pixels), np.log(contrast_of(blobs))], axis=1)
        chosen = mutual_best(_link_costs(ends, appearance, samples[j].time, leap))
        goes_on = np.flatnonzero(chosen >= 0)
        for row in goes_on.tolist():
            trails[alive[row]].append((j, int(chosen[row])))
        new = np.setdiff1d(np.arange(len(appearance)), chosen)
        waits = np.flatnonzero((chosen < 0) & (ends[:, 4] >= samples[j - 1].time if j else False))
        now = np.full((len(appearance), 1), samples[j].time)
        joined = np.hstack([appearance[chosen[goes_on]], now[: goes_on.size], ends[goes_on][:, [0, 1, 4]]])
        begun = np.hstack([appearance[new], now[: new.size], np.full((new.size, 3), np.nan)])
        alive = [alive[row] for row in (*goes_on, *waits)] + list(range(len(trails), len(trails) + new.size))
        ends = np.concatenate([joined, ends[waits], begun])
        trails += [[(j, b)] for b in new.tolist()]
    return _trails([trail for trail in trails if len(trail) > 1], found)


def _link_costs(ends: Array, appearance: Array, time: float, leap: float) -> Array:
    """Cost of every blob (appearance) as the next of every trail (ends), (n, m); inf where it cannot be."""
    wait = time - ends[:, 4]
    velocity = (ends[:, :2] - ends[:, 5:7]) / (ends[:, 4] - ends[:, 7])[:, None]
    known = np.isfinite(velocity[:, 0])
    velocity = np.where(known[:, None], velocity, 0.0)
    gate = np.where(known, np.minimum(leap, 10 + 0.6 * np.hypot(*velocity.T)), leap) * wait
    expected = ends[:, :2] + velocity * wait[:, None]
    off = np.hypot(appearance[:, 0] - expected[:, :1], appearance[:, 1] - expected[:, 1:]) / gate[:, None]
    size, light = (np.abs(appearance[:, i] - ends[:, i : i + 1]) for i in (2, 3))
    cost: Array = np.where((off < 1) & (size < 0.7) & (light < 0.5), off + size + light, np.inf)
    return cost


def _trails(linked: list[list[tuple[int, int]]], found: Sequence[Blobs]) -> list[Trail]:
    """Trails of the blobs (sample, blob) that were linked."""
    if not linked:
        return []
    sample, blob = np.array([one for trail in linked for one in trail], np.intp).T
    first = np.cumsum([0, *(len(blobs.Xf) for blobs in found)])
    at = first[sample] + blob
    whole = as_trail(sample, Blobs._make(np.concatenate(column)[at] for column in zip(*found, strict=True)))
    ends = np.cumsum([len(trail) for trail in linked])[:-1]
    return [Trail._make(parts) for parts in zip(*(np.split(column, ends) for column in whole), strict=True)]


def as_trail(sample: Ints, b: Blobs) -> Trail:
    size = np.stack([b.width, b.height], axis=1).astype(float)
    return Trail(
        sample,
        np.stack([b.Xf, b.Yf], axis=1),
        b.pixels.astype(float),
        contrast_of(b),
        size,
        b.pixels / size.prod(axis=1),
    )


def moves(trail: Trail, least_px: float) -> bool:
    """Whether a trail is long enough, and moves by more than so many px in all.

    What changes at one place is no motion: digits of a running time, a reflection, what a coder leaves of a target. Its
    middle goes to and fro within its own size, or leaps once to another blob.
    """
    if len(trail.sample) < LINKING.shortest:
        return False
    way = _way(trail.position)
    if not way > least_px:
        return False
    step = np.diff(trail.position, axis=0)
    largest = int(np.argmax(np.hypot(*step.T))) + 1
    if max(_way(trail.position[:largest]), _way(trail.position[largest:])) < LINKING.leaps * way:
        return False
    if way > LINKING.within * median_of(trail.size.max(axis=1)):
        return True
    spread = float(np.var(trail.position, axis=0, ddof=1).sum())
    return float(np.square(step).sum()) < LINKING.jitters * spread * len(step)


def _way(position: Array) -> float:
    """How far a thing was, px, along the axis along which that is most, at positions (m, 2) px."""
    return float(np.ptp(position, axis=0).max())


def merit(trail: Trail) -> float:
    """Length times contrast times compactness, less for what changes its size or jerks."""
    length = np.log1p(len(trail.sample))
    steady = 1 / (1 + 4 * float(np.std(np.log(trail.pixels))))
    bend = np.diff(trail.position, n=2, axis=0)
    jerk = median_of(np.abs(np.diff(bend, axis=0))) if len(bend) > 1 else 0.0
    smooth = 1 / (1 + jerk / 3)
    return float(length * median_of(trail.contrast) * compactness(trail) * steady * smooth)


def compactness(trail: Trail) -> float:
    """1 for a disc or square; falls with elongation and with holes and arms (a disc fills 0.785 of its box)."""
    w, h = (median_of(side) for side in trail.size.T)
    shape = min(w, h) / max(w, h)
    fill = min(1.0, median_of(trail.fill) / 0.65)
    return shape * fill * fill


def best_together(trails: list[Trail], n: int, samples: int) -> list[Trail]:
    """The n best that were all in view at some time pair by pair, so that pieces of one broken trail count once, and
    that never were in one place.
    """
    chosen: list[Trail] = []
    latest_begin, earliest_end = -1, 1 << 60
    places = np.full((2, samples, len(trails)), np.nan)
    for trail in trails:
        first, last = int(trail.sample[0]), int(trail.sample[-1])
        if len(chosen) == n or first > earliest_end or latest_begin > last:
            continue
        near = np.abs(places[:, trail.sample, : len(chosen)] - trail.position.T[:, :, None]) < trail.size.max() / 2 + 2
        if (near[0] & near[1]).any():
            continue
        places[:, trail.sample, len(chosen)] = trail.position.T
        chosen.append(trail)
        latest_begin, earliest_end = max(latest_begin, first), min(earliest_end, last)
    return chosen
