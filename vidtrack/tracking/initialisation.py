"""Targets found without being told: from their motion, or else from their brightness.

The first samples of a recording are searched for blobs; blobs that follow each other smoothly make a trail. Trails
that move are targets before things that stand still; among them the long, bright, compact ones come first. What
stands still and was not chosen is clutter, which the tracker then never takes for a target. The names go from top
to bottom, then left to right, of where the trails begin: the same every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints, Picture
from vidtrack.tracking.association.assignment import mutual_best
from vidtrack.tracking.detection.blobs import Blobs, above, above_local_background, no_blobs, rough_blobs
from vidtrack.tracking.detection.candidates import contrast_of
from vidtrack.tracking.detection.threshold import LEAST_CONTRAST, SIGMAS
from vidtrack.tracking.sample import Sample, in_frame_buffer
from vidtrack.tracking.settings import Detection

LEAP = 0.15
"""# ASSUME: share of the picture's diagonal that a target moves between samples, at most."""
SHORTEST = 3
"""Samples that a moving trail must have: fewer could be chance."""
STIR = 1.5
"""px that a trail must move in all to count as moving."""
FIRST = 5
"""Samples in which motion is sought at a time."""
ENOUGH = 0.9
"""Share of the targets that are found moving; the others may stand still."""
COMPACT = 0.45
"""Of 1 for a disc: what is less compact is taken for a target only where it plainly moves."""
MOST = 400
"""Blobs a sample that are linked, the most massive ones."""


class Trail(NamedTuple):
    """Blobs of one thing: sample numbers (m,), positions (m, 2) px, pixels, contrast (m,), sizes (m, 2), fill (m,)."""

    sample: Ints
    position: Array
    pixels: Array
    contrast: Array
    size: Array
    fill: Array


class Opening(NamedTuple):
    """The trails of the targets, in the order of their names, and what stands still besides.

    moving  how many of the trails were found from motion; they are not marked one by one
    """

    trails: list[Trail]
    clutter: Blobs
    moving: int


def find_targets(samples: Sequence[Sample], n: int, detection: Detection) -> Opening:
    """The n likeliest targets of a recording's first samples; fewer where fewer can be found.

    Motion is sought in the first few samples, and in later ones only until about n things move.
    """
    still = _blobs_above(samples[0], samples[0].luma, detection, None)
    trails: list[Trail] = []
    if len(samples) >= SHORTEST:
        backgrounds = background_of(samples, detection)
        for first in range(0, len(samples) - SHORTEST + 1, FIRST):
            moving = find_movers(samples[first : first + FIRST + 1], backgrounds, detection, n)
            here = [trail._replace(sample=trail.sample + first) for trail in _together(moving, n, FIRST + 1)]
            trails = here if len(here) > len(trails) else trails
            if len(trails) >= ENOUGH * n:
                break
    there = _standing(still, trails)
    standing = _lasting(there, samples, detection)
    if len(trails) < n and standing.Xf.size < there.Xf.size:
        trails += _slow(samples, trails, detection)[: n - len(trails)]
        standing = _standing(standing, trails)
    n_moving = len(trails)
    trails += _brightest(standing, n - n_moving)
    order = sorted(trails, key=lambda t: (round(float(t.position[0, 1])), round(float(t.position[0, 0]))))
    return Opening(order, _rest(standing, order), n_moving)


def _together(trails: list[Trail], n: int, samples: int) -> list[Trail]:
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


def find_movers(
    samples: Sequence[Sample], backgrounds: dict[int, NDArray[Any]], detection: Detection, n: int
) -> list[Trail]:
    """Trails that move over a background known before; best first where there are more than n."""
    trails = link([_moving_blobs(sample, backgrounds[sample.parity], detection) for sample in samples], samples)
    moving = [trail for trail in trails if _moves(trail)]
    return moving if len(moving) <= n else sorted(moving, key=_merit, reverse=True)


def _slow(samples: Sequence[Sample], chosen: Sequence[Trail], detection: Detection) -> list[Trail]:
    """Trails that move so slowly that the background has hidden them, and are none of the chosen; best first."""
    places = [
        np.concatenate([np.empty((0, 2)), *(t.position[t.sample == j] for t in chosen)]) for j in range(len(samples))
    ]
    trails = link([_blobs_above(sample, sample.luma, detection, None) for sample in samples], samples)
    others = [
        trail
        for trail in trails
        if _moves(trail)
        and _compact(trail) > COMPACT
        and not any(
            (np.hypot(*(places[j] - at).T) < 3).any() for j, at in zip(trail.sample, trail.position, strict=True)
        )
    ]
    seen = {j for j, place in enumerate(places) if len(place)}  # of any other sample nobody knows whose blob it is
    others = [trail for trail in others if not seen or seen & set(trail.sample.tolist())]
    return _together(sorted(others, key=_merit, reverse=True), len(others), len(samples))


def _lasting(standing: Blobs, samples: Sequence[Sample], detection: Detection) -> Blobs:
    """Those of the blobs that are still there in the last sample of the same kind."""
    if not standing.Xf.size:
        return standing
    last = next(sample for sample in reversed(samples) if sample.parity == samples[0].parity)
    late = _blobs_above(last, last.luma, detection, None)
    if not standing.Xf.size or not late.Xf.size:
        return standing if last is samples[0] else no_blobs()
    near = np.hypot(standing.Xf[:, None] - late.Xf, standing.Yf[:, None] - late.Yf) < 1.5
    alike = np.abs(np.log(standing.pixels[:, None] / late.pixels)) < 0.4
    return Blobs._make(column[(near & alike).any(axis=1)] for column in standing)


def clutter_besides(samples: Sequence[Sample], starts: Array, box: Array, detection: Detection) -> Blobs:
    """Blobs that stand still through the samples and began in no start box (n, 2 middles and sizes): no targets."""
    found = _lasting(_blobs_above(samples[0], samples[0].luma, detection, None), samples, detection)
    inside = (np.abs(found.Xf[:, None] - starts[:, 0]) < box[:, 0] / 2) & (
        np.abs(found.Yf[:, None] - starts[:, 1]) < box[:, 1] / 2
    )
    return Blobs._make(column[~inside.any(axis=1)] for column in found)


def background_of(samples: Sequence[Sample], detection: Detection) -> dict[int, NDArray[Any]]:
    """What stands still, turned bright: for each parity the second darkest of five pictures from first to last.

    Not their median: what moves slowly would leave a ghost of itself in that.
    """
    pictures: dict[int, NDArray[Any]] = {}
    for parity in {sample.parity for sample in samples}:
        stack = [sample.luma for sample in samples if sample.parity == parity]
        five = (stack[k] for k in np.rint(np.linspace(0, len(stack) - 1, 5)).astype(int))
        a, b, c, d, e = (detection.bright(picture) for picture in five)
        # seven comparisons, as cv2 compares 16 pixels at once
        low, other = cv2.min(a, b), cv2.min(c, d)
        darkest = cv2.min(low, other)
        second = cv2.min(cv2.max(low, other), cv2.min(cv2.max(a, b), cv2.max(c, d)))
        pictures[parity] = cv2.min(second, cv2.max(darkest, e))
    return pictures


def link(found: Sequence[Blobs], samples: Sequence[Sample]) -> list[Trail]:
    """Blobs of consecutive samples joined to trails: nearest to where the trail heads, alike in size and contrast."""
    rows, columns = samples[0].luma.shape
    leap = LEAP * float(np.hypot(rows * samples[0].lines, columns))
    trails: list[list[tuple[int, int]]] = []
    alive: list[int] = []
    ends = np.zeros((0, 8))  # x, y, log pixels, log contrast and time of the last blob; x, y and time of the one before
    for j, blobs in enumerate(found):
        looks = np.stack([blobs.Xf, blobs.Yf, np.log(blobs.pixels), np.log(contrast_of(blobs))], axis=1)
        chosen = mutual_best(_link_costs(ends, looks, samples[j].time, leap))
        goes_on = np.flatnonzero(chosen >= 0)
        for row in goes_on.tolist():
            trails[alive[row]].append((j, int(chosen[row])))
        new = np.setdiff1d(np.arange(len(looks)), chosen)
        waits = np.flatnonzero((chosen < 0) & (ends[:, 4] >= samples[j - 1].time if j else False))
        now = np.full((len(looks), 1), samples[j].time)
        joined = np.hstack([looks[chosen[goes_on]], now[: goes_on.size], ends[goes_on][:, [0, 1, 4]]])
        begun = np.hstack([looks[new], now[: new.size], np.full((new.size, 3), np.nan)])
        alive = [alive[row] for row in (*goes_on, *waits)] + list(range(len(trails), len(trails) + new.size))
        ends = np.concatenate([joined, ends[waits], begun])
        trails += [[(j, b)] for b in new.tolist()]
    return _trails([trail for trail in trails if len(trail) > 1], found)


def _link_costs(ends: Array, looks: Array, time: float, leap: float) -> Array:
    """Cost of every blob (looks) as the next of every trail (ends), (n, m); inf where it cannot be."""
    wait = time - ends[:, 4]
    velocity = (ends[:, :2] - ends[:, 5:7]) / (ends[:, 4] - ends[:, 7])[:, None]
    known = np.isfinite(velocity[:, 0])
    velocity = np.where(known[:, None], velocity, 0.0)
    gate = np.where(known, np.minimum(leap, 10 + 0.6 * np.hypot(*velocity.T)), leap) * wait
    expected = ends[:, :2] + velocity * wait[:, None]
    off = np.hypot(looks[:, 0] - expected[:, :1], looks[:, 1] - expected[:, 1:]) / gate[:, None]
    size, light = (np.abs(looks[:, i] - ends[:, i : i + 1]) for i in (2, 3))
    cost: Array = np.where((off < 1) & (size < 0.7) & (light < 0.5), off + size + light, np.inf)
    return cost


def _trails(linked: list[list[tuple[int, int]]], found: Sequence[Blobs]) -> list[Trail]:
    """Trails of the blobs (sample, blob) that were linked."""
    if not linked:
        return []
    sample, blob = np.array([one for trail in linked for one in trail], np.intp).T
    first = np.cumsum([0, *(len(blobs.Xf) for blobs in found)])
    at = first[sample] + blob
    whole = _as_trail(sample, Blobs._make(np.concatenate(column)[at] for column in zip(*found, strict=True)))
    ends = np.cumsum([len(trail) for trail in linked])[:-1]
    return [Trail._make(parts) for parts in zip(*(np.split(column, ends) for column in whole), strict=True)]


def _as_trail(sample: Ints, b: Blobs) -> Trail:
    size = np.stack([b.width, b.height], axis=1).astype(float)
    return Trail(
        sample,
        np.stack([b.Xf, b.Yf], axis=1),
        b.pixels.astype(float),
        contrast_of(b),
        size,
        b.pixels / size.prod(axis=1),
    )


def _moves(trail: Trail) -> bool:
    return len(trail.sample) >= SHORTEST and float(np.ptp(trail.position, axis=0).max()) > STIR


def _merit(trail: Trail) -> float:
    """Length times contrast times compactness, less for what changes its size or jerks."""
    length = np.log1p(len(trail.sample))
    steady = 1 / (1 + 4 * float(np.std(np.log(trail.pixels))))
    bend = np.diff(trail.position, n=2, axis=0)
    jerk = float(np.median(np.abs(np.diff(bend, axis=0)))) if len(bend) > 1 else 0.0
    smooth = 1 / (1 + jerk / 3)
    return float(length * np.median(trail.contrast) * _compact(trail) * steady * smooth)


def _compact(trail: Trail) -> float:
    """1 for a disc or square; falls with elongation and with holes and arms (a disc fills 0.785 of its box)."""
    w, h = np.median(trail.size, axis=0)
    shape = float(min(w, h) / max(w, h))
    fill = min(1.0, float(np.median(trail.fill)) / 0.65)
    return shape * fill * fill


def _moving_blobs(sample: Sample, background: NDArray[Any], detection: Detection) -> Blobs:
    """Blobs that stand out of the background picture."""
    over = cv2.subtract(detection.bright(sample.luma), background)
    level = max(SIGMAS * detection.noise * 1.5, 2 * LEAST_CONTRAST)
    some = over[:: 1 + over.size // 100_000]
    strong = some[some > level / detection.scale]
    if strong.size:
        level = max(level, 0.4 * float(np.percentile(strong, 90)) * detection.scale)
    return _blobs_above(sample, over, detection, level)


def _blobs_above(sample: Sample, picture: Picture, detection: Detection, level: float | None) -> Blobs:
    """Whole blobs of a sample where `picture` is above a level; without one, above the sample's own threshold."""
    image = detection.bright(sample.luma)
    if level is not None:
        mask = above(picture, level / detection.scale)
    elif detection.level is not None:
        mask = above(image, detection.level / detection.scale)
    else:
        mask = above_local_background(image, detection.scale, detection.noise)
    found = rough_blobs(image, mask, scale=detection.scale, min_pixels=detection.min_pixels)
    good = np.flatnonzero(~found.edge & (found.mass > 0))
    good = np.sort(good[np.argsort(-found.mass[good], kind="stable")[:MOST]])
    return in_frame_buffer(Blobs._make(column[good] for column in found), sample)


def _standing(found: Blobs, movers: list[Trail]) -> Blobs:
    """Blobs of the first sample that no moving trail has there."""
    here = [trail.position[0] for trail in movers if trail.sample[0] == 0]
    if not here or not found.Xf.size:
        return found
    at = np.array(here)
    same = np.hypot(found.Xf[:, None] - at[:, 0], found.Yf[:, None] - at[:, 1]) < 3
    return Blobs._make(column[~same.any(axis=1)] for column in found)


def _brightest(standing: Blobs, n: int) -> list[Trail]:
    """The n compact blobs of greatest contrast and size among those that stand still."""
    if n <= 0 or not standing.Xf.size:
        return []
    each = [
        _as_trail(np.zeros(1, np.intp), Blobs._make(c[i : i + 1] for c in standing)) for i in range(len(standing.Xf))
    ]
    compact = [trail for trail in each if _compact(trail) > COMPACT]
    return sorted(compact, key=lambda t: float(t.contrast[0] * np.sqrt(t.pixels[0])) * _compact(t), reverse=True)[:n]


def _rest(standing: Blobs, chosen: list[Trail]) -> Blobs:
    """What stands still and is not among the chosen."""
    if not standing.Xf.size:
        return no_blobs()
    kept = np.ones(standing.Xf.size, bool)
    for trail in chosen:
        kept &= np.hypot(standing.Xf - trail.position[0, 0], standing.Yf - trail.position[0, 1]) > 3
    return Blobs._make(column[kept] for column in standing)
