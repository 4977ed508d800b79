"""Track initialisation: targets found from their motion, or else from their brightness, or in given start boxes.

The first samples of a recording are searched for candidates; candidates that follow each other smoothly make a trail.
Trails that move are targets before things that stand still; among them the long, bright, compact ones come first. What
stands still and was not chosen is clutter, which the tracker then never takes for a target. The names go from top
to bottom, then left to right, of where the trails begin: the same every time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of, bright_mask
from vidtrack.tracking.detection.blobs import (
    Blobs,
    above,
    in_frame_buffer,
    no_blobs,
    rough_blobs,
)
from vidtrack.tracking.detection.threshold import THRESHOLD
from vidtrack.tracking.initiation.trails import (
    LINKING,
    Trail,
    as_trail,
    best_together,
    compactness,
    link,
    merit,
    moves,
)
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Initialisation:
    """How targets are found in the first samples.

    samples        in which motion is sought at a time
    enough_moving  of the targets that are found moving; the others may stand still
    compact        of 1 for a disc: what is less compact is a target only where it plainly moves
    dim            times the least level: where even the brighter of what moves asks for no higher one, all of it is dim
    blinks         samples at the end in one of which a trail must still be seen; most: share of all that it lasts
    gone           share of its merit that is left to one that does not
    blobs_at_most  in a sample that are linked, the most massive ones
    """

    samples: int = 5
    enough_moving: float = 0.9
    compact: float = 0.45
    dim: float = 1.05
    blinks: int = 2
    most: float = 0.5
    gone: float = 0.25
    blobs_at_most: int = 400


INITIALISATION = Initialisation()


class Opening(NamedTuple):
    """The trails of the targets, in the order of their names, and what stands still besides.

    moving  how many of the trails were found from motion; they are not marked one by one
    backgrounds  of the samples, as `background_of` makes them; None where there are too few samples
    """

    trails: list[Trail]
    clutter: Blobs
    moving: int
    backgrounds: dict[int, NDArray[Any]] | None = None


def find_targets(samples: Sequence[Sample], n: int, detection: Detection) -> Opening:
    """The n likeliest targets of a recording's first samples; fewer where fewer can be found.

    Motion is sought in the first few samples, and in later ones only until about n things move.
    """
    still = _blobs_above(samples[0], samples[0].luma, detection, None)
    trails: list[Trail] = []
    backgrounds = background_of(samples, detection) if len(samples) >= LINKING.shortest else None
    if backgrounds is not None:
        for first in range(0, len(samples) - LINKING.shortest + 1, INITIALISATION.samples):
            some = samples[first : first + INITIALISATION.samples + 1]
            moving = find_movers(some, backgrounds, detection, n)
            if len(moving) > n and len(samples) - first > len(some):  # the targets are what lasts
                some = samples[first:]
                moving = find_movers(some, backgrounds, detection, n)
            here = [trail._replace(sample=trail.sample + first) for trail in best_together(moving, n, len(some))]
            trails = here if len(here) > len(trails) else trails
            if len(trails) >= INITIALISATION.enough_moving * n:
                break
    there = _still_besides(still, trails)
    still = _lasting(there, samples, detection)
    if len(trails) < n and still.Xf.size < there.Xf.size:
        trails += _slow(samples, trails, detection)[: n - len(trails)]
        still = _still_besides(still, trails)
    n_moving = len(trails)
    trails += _brightest(still, n - n_moving)
    order = sorted(trails, key=lambda t: (round(float(t.position[0, 1])), round(float(t.position[0, 0]))))
    return Opening(order, _rest(still, order), n_moving, backgrounds)


def find_movers(
    samples: Sequence[Sample], backgrounds: Mapping[int, NDArray[Any]], detection: Detection, n: int
) -> list[Trail]:
    """Trails that move over a background known before; best first where there are more than n."""
    found = [_moving_blobs(sample, backgrounds[sample.parity], detection) for sample in samples]
    trails = link(found, samples, detection.max_step)
    moving = [trail for trail in trails if moves(trail, detection.min_motion)]
    if len(moving) <= n:
        return moving
    k = len(samples)

    def lasting(trail: Trail) -> float:  # what glitters is bright, and soon gone
        lasts = trail.sample[-1] >= k - INITIALISATION.blinks and len(trail.sample) >= INITIALISATION.most * k
        return merit(trail) * (1.0 if lasts else INITIALISATION.gone)

    return sorted(moving, key=lasting, reverse=True)


def _slow(samples: Sequence[Sample], chosen: Sequence[Trail], detection: Detection) -> list[Trail]:
    """Trails that move so slowly that the background has hidden them, and are none of the chosen; best first."""
    sample = np.concatenate([np.empty(0, np.intp), *(trail.sample for trail in chosen)])
    position = np.concatenate([np.empty((0, 2)), *(trail.position for trail in chosen)])
    half = np.concatenate([np.empty((0, 2)), *(trail.size * (1, samples[0].lines) / 2 for trail in chosen)])
    places = [(position[sample == j], half[sample == j]) for j in range(len(samples))]
    found = [_blobs_above(sample, sample.luma, detection, None) for sample in samples]
    trails = link(found, samples, detection.max_step)
    others = [
        trail
        for trail in trails
        if not any(_within(at, *places[j]) for j, at in zip(trail.sample, trail.position, strict=True))
        and moves(trail, detection.min_motion)  # in this order: most are what was chosen, which is soon seen
        and compactness(trail) > INITIALISATION.compact
    ]
    # in any other sample it is not known whose blob it is
    seen = {j for j, (place, _) in enumerate(places) if len(place)}
    others = [trail for trail in others if not seen or seen & set(trail.sample.tolist())]
    return best_together(sorted(others, key=merit, reverse=True), len(others), len(samples))


def _within(at: Array, places: Array, half: Array) -> bool:
    """Whether a place (2,) is one of the places (m, 2), or lies in what is there, of sizes 2 half: is a part of it."""
    off = np.abs(places - at)
    return bool(((off < np.maximum(half, 2.1)).all(axis=-1)).any())


def _lasting(still: Blobs, samples: Sequence[Sample], detection: Detection) -> Blobs:
    """Those of the blobs that are still there in the last sample of the same kind."""
    if not still.Xf.size:
        return still
    last = next(sample for sample in reversed(samples) if sample.parity == samples[0].parity)
    late = _blobs_above(last, last.luma, detection, None)
    if not still.Xf.size or not late.Xf.size:
        return still if last is samples[0] else no_blobs()
    near = np.hypot(still.Xf[:, None] - late.Xf, still.Yf[:, None] - late.Yf) < 1.5
    alike = np.abs(np.log(still.pixels[:, None] / late.pixels)) < 0.4
    return Blobs._make(column[(near & alike).any(axis=1)] for column in still)


def clutter_besides(samples: Sequence[Sample], starts: Array, box: Array, detection: Detection) -> Blobs:
    """Blobs that stand still through the samples and began in no start box (n, 2 middles and sizes): no targets."""
    found = _lasting(_blobs_above(samples[0], samples[0].luma, detection, None), samples, detection)
    inside = (np.abs(found.Xf[:, None] - starts[:, 0]) < box[:, 0] / 2) & (
        np.abs(found.Yf[:, None] - starts[:, 1]) < box[:, 1] / 2
    )
    return Blobs._make(column[~inside.any(axis=1)] for column in found)


def _moving_blobs(sample: Sample, background: NDArray[Any], detection: Detection) -> Blobs:
    """Blobs that stand out of the background picture."""
    over = cv2.subtract(detection.bright(sample.luma), background)
    least = max(THRESHOLD.sigmas * detection.moving_noise * 1.5, 2 * THRESHOLD.least_contrast)
    level = _level_of(over, least, detection)
    if level < INITIALISATION.dim * least:  # half of a dim target is below it: its pixels together are far above noise
        over = cv2.blur(over, (3, 3))
        level = _level_of(over, max(least / 3, THRESHOLD.least_contrast), detection)
    return _blobs_above(sample, over, detection, level)


def _level_of(over: Picture, least: float, detection: Detection) -> float:
    """A share of the way to the brighter of what stands out by at least so much, grey levels."""
    some = over[:: 1 + over.size // 100_000]
    strong = some[some > least / detection.scale]
    return max(least, 0.4 * float(np.percentile(strong, 90)) * detection.scale) if strong.size else least


def _blobs_above(sample: Sample, picture: Picture, detection: Detection, level: float | None) -> Blobs:
    """Whole blobs of a sample where `picture` is above a level; without one, above the sample's own threshold."""
    image = detection.bright(sample.luma)
    mask = bright_mask(image, detection) if level is None else above(picture, level / detection.scale)
    found = rough_blobs(image, mask, scale=detection.scale, min_pixels=detection.min_pixels)
    good = np.flatnonzero(~found.edge & (found.mass > 0))
    good = np.sort(good[np.argsort(-found.mass[good], kind="stable")[: INITIALISATION.blobs_at_most]])
    return in_frame_buffer(Blobs._make(column[good] for column in found), sample)


def _still_besides(found: Blobs, movers: list[Trail]) -> Blobs:
    """Blobs of the first sample that no moving trail has there."""
    here = [trail.position[0] for trail in movers if trail.sample[0] == 0]
    if not here or not found.Xf.size:
        return found
    at = np.array(here)
    same = np.hypot(found.Xf[:, None] - at[:, 0], found.Yf[:, None] - at[:, 1]) < 3
    return Blobs._make(column[~same.any(axis=1)] for column in found)


def _brightest(still: Blobs, n: int) -> list[Trail]:
    """The n compact blobs of greatest contrast and size among those that stand still."""
    if n <= 0 or not still.Xf.size:
        return []
    each = [as_trail(np.zeros(1, np.intp), Blobs._make(c[i : i + 1] for c in still)) for i in range(len(still.Xf))]
    compact = [trail for trail in each if compactness(trail) > INITIALISATION.compact]
    return sorted(compact, key=lambda t: float(t.contrast[0] * np.sqrt(t.pixels[0])) * compactness(t), reverse=True)[:n]


def _rest(still: Blobs, chosen: list[Trail]) -> Blobs:
    """What stands still and is not among the chosen."""
    if not still.Xf.size:
        return no_blobs()
    kept = np.ones(still.Xf.size, bool)
    for trail in chosen:
        kept &= np.hypot(still.Xf - trail.position[0, 0], still.Yf - trail.position[0, 1]) > 3
    return Blobs._make(column[kept] for column in still)
