"""Where targets begin, for the tracker: in start boxes, on trails of the opening, or later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.assignment import mutual_best
from vidtrack.errors import VidtrackError
from vidtrack.naming import some_of
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.static_clutter import places, start_places
from vidtrack.tracking.initiation.clip import Clip
from vidtrack.tracking.initiation.initialisation import INITIALISATION, clutter_besides, find_movers, find_targets
from vidtrack.tracking.initiation.trails import LINKING, Trail
from vidtrack.tracking.quality.assessment import InBox, in_boxes
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MEMORY, NEVER, Starts
from vidtrack.tracking.tracker import Tracker

MANY = 400
"""More targets than any opening shows."""


@dataclass(frozen=True)
class Fast:
    """Which targets in start boxes are fast.

    of_box  px a sample: a target that moves less is found in its box in the next sample anyway
    """

    of_box: float = 0.2


FAST = Fast()


class Begun(NamedTuple):
    """How the targets begin.

    starts, clutter  as `Tracker` takes them; places (n, 4) as `static_clutter` does
    waiting          targets that have not been seen yet; how: in words, which were found by what
    expected         what each start box shows; None where the targets were found
    contrast         grey levels, of the faintest target; NaN where none is known
    backgrounds      of the opening, as `background_of` makes them; None where they were not needed
    """

    starts: Starts
    clutter: Blobs
    places: Array
    waiting: list[int]
    how: str
    expected: list[InBox] | None
    contrast: float
    backgrounds: dict[int, NDArray[Any]] | None = None


def named_boxes(
    targets: int | Sequence[str] | Literal["all"], start_boxes: Mapping[str, NDArray[Any]], box: tuple[float, float]
) -> dict[str, Array]:
    """The box (4,) of each target: middle, width and height, px, of which `box` gives what is not listed.

    start_boxes   columns target, Xf, Yf and, where there are any, width, height
    Raises VidtrackError for a target that is named and has none.
    """
    listed = [str(name) for name in start_boxes["target"]]
    names = listed if isinstance(targets, (int, str)) else [str(t) for t in targets]
    for name in names:
        if name not in listed:
            raise VidtrackError(
                f"targets.csv: no start box for target {name!r} in a camera that has {some_of(listed)}. A target has "
                "one name in all cameras: add its row, or take it off the list."
            )
    rows = [listed.index(name) for name in names]
    boxes = np.empty((len(names), 4))
    boxes[:, 0], boxes[:, 1] = start_boxes["Xf"][rows], start_boxes["Yf"][rows]
    for column, key, usual in ((2, "width", box[0]), (3, "height", box[1])):
        given = np.asarray(start_boxes[key], float)[rows] if key in start_boxes else np.full(len(names), np.nan)
        boxes[:, column] = np.where(np.isfinite(given), given, usual)
    return dict(zip(names, boxes, strict=True))


def count_movers(clip: Clip, most: int) -> int:
    """How many things move in the opening of a recording, of up to `most` frames; at least one."""
    clip.read_on(most)
    return max(1, find_targets(clip.shown()[0], MANY, clip.detection).moving)


def begun_in_boxes(clip: Clip, boxes: Array) -> Begun:
    """Targets in start boxes (n, 4), middle, width and height, px."""
    samples, _ = clip.shown()
    clutter = clutter_besides(samples, boxes[:, :2], boxes[:, 2:], clip.detection)
    corners = np.hstack([boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, :2] + boxes[:, 2:] / 2])
    own = start_places(samples[0], corners, clip.detection)
    shown = in_boxes(samples[0], boxes, clip.detection)
    plain = [one.contrast for one in shown if one.contrast > SURROUNDINGS.stands_out * clip.detection.noise]
    starts = _with_fast(starts_in_boxes(boxes), samples, clip.detection)
    return Begun(starts, clutter, own, [], "start boxes", shown, min(plain, default=np.nan))


def begun_without_boxes(
    clip: Clip, targets: int | Sequence[str] | Literal["all"], box: tuple[float, float], most: int
) -> tuple[list[str], Begun]:
    """So many targets, or those of these names, or as many as move; names t1, t2 ... where they have none."""
    n = count_movers(clip, most) if targets == "all" else targets
    names = [f"t{i + 1}" for i in range(n)] if isinstance(n, int) else [str(t) for t in n]
    return names, begun_anywhere(clip, len(names), box, most)


def begun_anywhere(clip: Clip, n: int, box: tuple[float, float], most: int) -> Begun:
    """n targets found by motion, or else by brightness; what does not move yet is waited for, up to `most` frames."""
    samples, order = clip.shown()
    found = find_targets(samples, n, clip.detection)
    if found.moving < INITIALISATION.enough_moving * n:
        clip.read_on(most)
        samples, order = clip.shown()
        found = find_targets(samples, n, clip.detection)
    trails = [trail._replace(sample=order[trail.sample]) for trail in found.trails]
    own = places([trail.position for trail in trails], [trail.size for trail in trails], samples[0].lines)
    contrast = min((median_of(trail.contrast) for trail in trails), default=np.nan)
    how = f"{found.moving} from motion, {len(trails) - found.moving} from brightness"
    starts, waiting = starts_of_trails(trails, n, box), list(range(len(trails), n))
    return Begun(starts, found.clutter, own, waiting, how, None, contrast, found.backgrounds)


def starts_in_boxes(boxes: Array) -> Starts:
    """Starts in boxes (n, 4), middle, width and height, px: nothing else is known yet."""
    n = len(boxes)
    pixels, contrast, background = np.full((3, n), np.nan)
    velocity, acceleration, size = np.full((3, n, 2), np.nan)
    first = np.zeros(n, np.intp)
    position, box = boxes[:, :2].copy(), boxes[:, 2:].copy()
    return Starts(position, velocity, acceleration, box, first, pixels, contrast, background, size)


def _with_fast(starts: Starts, samples: Sequence[Sample], detection: Detection) -> Starts:
    """The starts with velocity and appearance of what moves fast through a box in the first samples.

    From the box alone such a target would be lost before its velocity is known.
    """
    if len(samples) < LINKING.shortest:
        return starts
    some = samples[: INITIALISATION.samples + 1]
    trails = [
        trail
        for trail in find_movers(some, background_of(samples, detection), detection, len(starts.first))
        if trail.sample[0] == 0 and len(trail.sample) > 2
    ]
    if not trails:
        return starts
    begun = starts_of_trails(trails, len(trails), (0.0, 0.0))
    off = np.abs(starts.position[:, None] - begun.position) / starts.box[:, None]
    fast = np.hypot(*begun.velocity.T) > FAST.of_box * starts.box.min(axis=1)[:, None]
    cost = np.where((off < 0.5).all(axis=-1) & fast, np.hypot(off[..., 0], off[..., 1]), np.inf)
    chosen = mutual_best(cost)
    who, of = np.flatnonzero(chosen >= 0), chosen[chosen >= 0]
    new = Starts._make(column.copy() for column in starts)
    for name in ("position", "velocity", "acceleration", "pixels", "contrast", "background", "size"):
        getattr(new, name)[who] = getattr(begun, name)[of]
    return new


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
        appearance = np.array([[trails[i].pixels, trails[i].contrast, *trails[i].size.T] for i in alike])
        # where it hardly moved at first, its own place in the background hides part of it
        starts.pixels[alike], starts.contrast[alike], *size = np.percentile(appearance, 75, axis=2).T
        starts.size[alike] = np.stack(size, axis=1)
    return starts


def late_comers(
    tracker: Tracker,
    samples: Sequence[Sample],
    backgrounds: Mapping[int, NDArray[Any]],
    detection: Detection,
    waiting: list[int],
) -> list[int]:
    """Give trails that began in these samples to targets that have not been seen yet; returns which still wait.

    What another one turned out to be besides (`Clumps`) waits no longer.
    """
    waiting = [i for i in waiting if tracker.state.missing[i] < 0]
    samples = samples[-MEMORY.samples :]
    known = tracker.state.positions[-len(samples) :, : tracker.record.n]
    whole = [j for j, sample in enumerate(samples) if not sample.corrupt]
    samples, known = [samples[j] for j in whole], known[whole]
    if len(samples) < LINKING.shortest:
        return waiting
    for trail in find_movers(samples, backgrounds, detection, len(waiting)):
        if not waiting:
            break
        apart = known[trail.sample] - trail.position[:, None]
        if trail.sample[-1] < len(samples) - 2 or (np.hypot(apart[..., 0], apart[..., 1]) < 5).any():
            continue
        times = np.array([samples[j].time for j in trail.sample])
        appearance = [float(trail.pixels[-1]), float(trail.contrast[-1]), np.nan, *trail.size[-1].tolist()]
        tracker.begin(waiting.pop(0), trail.position, times, appearance)
    return waiting
