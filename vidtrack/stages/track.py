"""Track: follow every target of a run through one camera's recording.

with open_video("runs/toss/cam1.mp4") as video:
    tracked = track(video.frames(ahead=True), video.info, targets=["ball"])
tracked.centroids[["time_s", "Xf", "Yf"]]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.timing.excerpt import between
from vidtrack.timing.fields import chosen_order, order_from_motion, order_from_pictures, split
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.contrast_stretch import BITS, Stretch, stretch
from vidtrack.tracking.detection.static_clutter import Standing, places, standing_things, start_places
from vidtrack.tracking.detection.threshold import automatic, background_level, noise_sd
from vidtrack.tracking.initialisation import (
    ENOUGH,
    SHORTEST,
    Trail,
    background_of,
    clutter_besides,
    find_movers,
    find_targets,
)
from vidtrack.tracking.measurement.empirical_sd import Scatter
from vidtrack.tracking.measurement.sd_scaling import grow_sd
from vidtrack.tracking.measurement.window import PIXELS, X, Y
from vidtrack.tracking.reacquisition import FLAGS, RECOVERED
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.settings import Detection
from vidtrack.tracking.tracker import MEMORY, Rows, Starts, Tracker, present
from vidtrack.tracking.tracking_quality import described, pixel_counts, pixel_locking, shares

if TYPE_CHECKING:
    from pandas import DataFrame


HELD_BYTES = 64_000_000
"""Pictures kept in memory, at the beginning to find targets in."""
FEW, OPENING = 12, 48
"""Frames looked at before tracking begins: a few, or more where too little moves in those."""
BATCH = 4
"""Frames given to the tracker at once."""
NEVER = 1 << 60


class Tracked(NamedTuple):
    """centroids: one row a sample and target, as `track` tells; diagnostics: plain values, pictures under `worst`."""

    centroids: DataFrame
    diagnostics: dict[str, Any]


def track(
    frames: Iterable[Frame],
    info: VideoInfo,
    *,
    targets: int | Sequence[str] = 1,
    start_boxes: DataFrame | None = None,
    polarity: Literal["bright", "dark"] = "bright",
    threshold: float | Literal["auto"] = "auto",
    centroid: Literal["weighted", "binary", "ellipse"] = "weighted",
    min_pixels: int = 4,
    box: tuple[float, float] = (50, 50),
    fields: Literal["auto", "frame", "top", "bottom"] = "auto",
    start: str | int | None = None,
    end: str | int | None = None,
    gain: float | Literal["auto"] = "auto",
    offset: float | Literal["auto"] = "auto",
) -> Tracked:
    """Follow targets through a recording.

    frames       in order of time; their pictures must last while the next ones are read (those of `open_video` do)
    targets      how many (named t1, t2, ...), or their names
    start_boxes  target, Xf, Yf and where they differ from `box` width, height, px: where each target is in the first
                 sample. None: targets are found by motion, or else by brightness, and named from top to bottom, left
                 to right
    threshold    grey level 0-255 on any depth; auto: half-way between each target and its own background
    fields       auto: as the motion and the flags say; frame: whole frames; top, bottom: the field that comes first
    start, end   frame number or time code of the first and the last sample used
    gain, offset as `stretch` takes them; every grey level here and in the table is a stretched one

    The table has frame, field, time_s (camera clock of the time code, not corrected), timecode, target, Xf, Yf, sd_x,
    sd_y (px, from noise and contrast, grown to what `scatter` tells), pixels, total_pixels, mass, contrast, background
    (grey levels), box_x, box_y (px, the box's left top corner), box_w, box_h, flag. A target that was not measured has
    NaN and a flag that says why; its box is a guess.
    Raises VidtrackError for start boxes and targets that do not match and for a `start` that leaves no frame.
    """
    names, boxes = _named(targets, start_boxes, box)
    size = info.width * info.height * (1 if info.bits == 8 else 2)
    used = between(frames, info, start, end, where="detect")
    detect = _Detect(polarity, threshold, centroid, min_pixels, fields, gain, offset)
    clip = _Clip(_batches(used, max(1, min(BATCH, HELD_BYTES // (8 * size)))), info, detect)
    if boxes is not None:
        begun = _begun_in_boxes(clip, boxes)
    else:
        begun = _begun_anywhere(clip, len(names), box, max(FEW, min(OPENING, HELD_BYTES // (2 * size))))
    samples = clip.samples(clip.opening)
    backgrounds = background_of(samples, clip.detection)
    about = standing_things(samples, backgrounds, clip.detection, begun.places)
    tracker = Tracker(begun.starts, clip.detection, clip.level, clutter=begun.clutter, standing=about)
    tracker.follow(samples)
    earlier = _backwards(samples, begun.starts, clip.detection, clip.level, about)
    stamps, waiting = _stamps(clip.opening), begun.waiting
    clip.opening, samples = [], []
    for batch in clip.batches:
        samples = clip.samples(batch)
        tracker.follow(samples)
        stamps += _stamps(batch)
        if waiting:
            tracker.finish()
            waiting = _late_comers(tracker, samples, backgrounds, clip.detection, waiting)
    tracker.finish()
    rows = _with_earlier(tracker.rows(), earlier)
    moment = _moments(stamps, clip.order)
    lines = len(set(moment.offset))
    time = lines * (moment.time * float(info.rate) + moment.offset)
    seen = grow_sd(rows, time, lines=lines, kind=centroid)
    table = _table(rows, moment, names, begun.starts, info)
    diagnostics = _diagnosed(rows, moment, names, tracker, info) | clip.told() | {"begun": begun.how}
    _tell_scatter(diagnostics, seen, names)
    if waiting:
        missing = ", ".join(names[i] for i in waiting)
        diagnostics["problems"].append(f"never found: {missing}. Give a start box in targets.csv, or a threshold.")
    return Tracked(table, diagnostics)


class _Detect(NamedTuple):
    """The settings by which targets are told from the background, as `track` takes them."""

    polarity: str
    threshold: float | str
    centroid: Any
    min_pixels: int
    fields: str
    gain: Any
    offset: Any


class _Clip:
    """A recording as it is tracked.

    opening, batches  frames that were read to begin with, and those to come; stretched where that is needed
    order      "frame", or the field that comes first
    detection  for its samples; level: the clip's threshold, grey level of pictures turned bright
    """

    def __init__(self, batches: Iterator[list[Frame]], info: VideoInfo, detect: _Detect) -> None:
        self.opening, self.batches = _more([], batches, FEW), batches
        if not self.opening:
            raise VidtrackError("the recording has no frame to track in. Give one that has.")
        self._info, self._detect, self._levels = info, detect, self._wanted(info, detect)
        self._noise = noise_sd(self.opening[0].luma, scale=255.0 / (2**info.bits - 1))
        self._stretch()
        self.order, self._why = _field_order(detect.fields, info, self.opening)
        self._judge()

    def read_on(self, most: int) -> None:
        """Take more frames into the opening, `most` in all or a few more."""
        self.opening = _more(self.opening, self.batches, most)
        if self._levels is None:
            self._levels = self._wanted(self._info, self._detect)
            if self._levels is not None:
                self._stretch()
                self._judge()

    def samples(self, frames: Sequence[Frame]) -> list[Sample]:
        """Samples in order of time: one a frame, or its two fields."""
        rate = float(self._info.rate)
        if self.order == "frame":
            return [Sample(f.luma, float(f.time) * rate, 0, 1, f.corrupt) for f in frames]
        fields = ((f, field) for f in frames for field in split(f.luma, self.order))
        return [Sample(d.luma, 2 * (float(f.time) * rate + d.offset), d.parity, 2, f.corrupt) for f, d in fields]

    def told(self) -> dict[str, Any]:
        """How it is seen, for the diagnostics."""
        gain, offset = (self._levels.gain, self._levels.offset) if self._levels else (1.0, 0.0)
        return {
            "fields": self._why,
            "noise": self.detection.noise,
            "threshold": self.level,
            "stretch": {"gain": gain, "offset": offset},
        }

    def _wanted(self, info: VideoInfo, detect: _Detect) -> Stretch | None:
        """The stretch of grey levels that the opening needs; damaged pictures count where there are no others."""
        whole = [frame.luma for frame in self.opening if not frame.corrupt] or [frame.luma for frame in self.opening]
        return stretch(whole, info.bits, dark=detect.polarity == "dark", gain=detect.gain, offset=detect.offset)

    def _stretch(self) -> None:
        """Pass all frames through the stretch, if one is wanted."""
        levels = self._levels
        if levels is None:
            return

        def through(frames: list[Frame]) -> list[Frame]:
            return [frame._replace(luma=levels.over(frame.luma)) for frame in frames]

        self.opening, self.batches = through(self.opening), map(through, self.batches)
        self._info, self._noise = replace(self._info, bits=BITS), self._noise * levels.gain

    def _judge(self) -> None:
        """Set detection and level by the first frame."""
        full, detect = float(2**self._info.bits - 1), self._detect
        level = None if detect.threshold == "auto" else float(detect.threshold)
        dark = detect.polarity == "dark"
        self.detection = Detection(255.0 / full, full, dark, level, self._noise, detect.centroid, detect.min_pixels)
        self.level = _level(self.samples(self.opening[:1])[0], self.detection)


class _Begun(NamedTuple):
    """How the targets begin.

    starts, clutter  as `Tracker` takes them; places (n, 4) as `standing_things` does
    waiting          targets that nobody has seen yet; how: in words, who was found by what
    """

    starts: Starts
    clutter: Blobs
    places: Array
    waiting: list[int]
    how: str


def _begun_in_boxes(clip: _Clip, boxes: Array) -> _Begun:
    """Targets in start boxes (n, 4), middle, width and height, px."""
    samples = clip.samples(clip.opening)
    clutter = clutter_besides(samples, boxes[:, :2], boxes[:, 2:], clip.detection)
    corners = np.hstack([boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, :2] + boxes[:, 2:] / 2])
    own = start_places(samples[0], corners, clip.detection)
    return _Begun(_starts_in_boxes(boxes), clutter, own, [], "start boxes")


def _begun_anywhere(clip: _Clip, n: int, box: tuple[float, float], most: int) -> _Begun:
    """n targets found by motion, or else by brightness; what does not move yet is waited for, up to `most` frames."""
    samples = clip.samples(clip.opening)
    found = find_targets(samples, n, clip.detection)
    if found.moving < ENOUGH * n:
        clip.read_on(most)
        samples = clip.samples(clip.opening)
        found = find_targets(samples, n, clip.detection)
    trails = found.trails
    own = places([trail.position for trail in trails], [trail.size for trail in trails], samples[0].lines)
    how = f"{found.moving} from motion, {len(trails) - found.moving} from brightness"
    return _Begun(_starts_of_trails(trails, n, box), found.clutter, own, list(range(len(trails), n)), how)


def _named(
    targets: int | Sequence[str], start_boxes: DataFrame | None, box: tuple[float, float]
) -> tuple[list[str], Array | None]:
    """Names, and boxes (n, 4): middle, width and height, px."""
    if start_boxes is None or not len(start_boxes):
        return ([f"t{i + 1}" for i in range(targets)] if isinstance(targets, int) else [str(t) for t in targets]), None
    listed = [str(name) for name in start_boxes["target"]]
    names = listed if isinstance(targets, int) else [str(t) for t in targets]
    for name in names:
        if name not in listed:
            raise VidtrackError(f"targets.csv: no start box for target {name!r}. Add its row, or take it off the list.")
    rows = start_boxes.iloc[[listed.index(name) for name in names]]
    boxes = np.empty((len(names), 4))
    boxes[:, 0], boxes[:, 1] = rows["Xf"], rows["Yf"]
    for column, key, usual in ((2, "width", box[0]), (3, "height", box[1])):
        given = np.asarray(rows[key], float) if key in rows else np.full(len(names), np.nan)
        boxes[:, column] = np.where(np.isfinite(given), given, usual)
    return names, boxes


def _batches(frames: Iterable[Frame], size: int) -> Iterator[list[Frame]]:
    waiting = iter(frames)
    while batch := list(islice(waiting, size)):
        yield batch


def _more(frames: list[Frame], batches: Iterator[list[Frame]], most: int) -> list[Frame]:
    """The frames with those that follow, `most` in all or a few more."""
    frames = list(frames)
    while len(frames) < most and (batch := next(batches, None)) is not None:
        frames += batch
    return frames


def _field_order(fields: str, info: VideoInfo, opening: list[Frame]) -> tuple[str, str]:
    """ "frame", or the field that comes first; and why."""
    if fields != "auto":
        return fields, f"fields: {fields}, as set"
    if info.is_still:
        return "frame", "fields: a still"
    if info.field_order == "progressive":
        return "frame", "fields: progressive, from the flags"
    order, why = chosen_order(info.field_order, order_from_pictures(frame.luma[:, ::4] for frame in opening[:16]))
    return (order if order in ("top", "bottom") else "frame"), why


def _level(sample: Sample, detection: Detection) -> float:
    """The clip's threshold, grey level of pictures turned bright."""
    if detection.level is not None:
        return detection.level
    image = detection.bright(sample.luma)
    base = background_level(image, scale=detection.scale)
    over = image.astype(np.float32) * np.float32(detection.scale) - np.float32(base)
    return base + automatic(over, detection.noise)


class _Moments(NamedTuple):
    """Per sample: the frame's number and time stamp (s), which field, and frames by which it is later."""

    frame: NDArray[np.int64]
    time: Array
    field: NDArray[np.object_]
    offset: Array


def _stamps(frames: Sequence[Frame]) -> list[tuple[int, float]]:
    return [(frame.index, float(frame.time)) for frame in frames]


def _moments(stamps: Sequence[tuple[int, float]], order: str) -> _Moments:
    fields = ["frame"] if order == "frame" else [order, "bottom" if order == "top" else "top"]
    each = len(fields)
    index, time = zip(*stamps, strict=True)
    return _Moments(
        np.repeat(np.array(index, np.int64), each),
        np.repeat(np.array(time, float), each),
        np.array(fields * len(stamps), object),
        np.tile(np.arange(each) / 2.0, len(stamps)),
    )


def _starts_in_boxes(boxes: Array) -> Starts:
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


def _starts_of_trails(trails: Sequence[Trail], n: int, box: tuple[float, float]) -> Starts:
    """Starts of the trails, then of those that nobody has seen yet."""
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


def _backwards(
    samples: Sequence[Sample], starts: Starts, detection: Detection, level: float, standing: Standing | None
) -> list[tuple[int, Rows]]:
    """What the samples before a target's own first one show, followed back in time: (target, rows in order)."""
    followed = []
    for i in np.flatnonzero((starts.first > 0) & (starts.first < NEVER)):
        before = list(reversed(samples[: starts.first[i]]))
        last = samples[starts.first[i]].time
        one = Starts._make(column[i : i + 1].copy() for column in starts)
        gone = last - before[0].time
        one = one._replace(
            position=one.position - one.velocity * gone, velocity=-one.velocity, first=np.zeros(1, np.intp)
        )
        back = Tracker(one, detection, level, standing=standing, far=False)
        back.follow([sample._replace(time=last - sample.time) for sample in before])
        back.finish()
        rows = back.rows()
        followed.append((int(i), Rows(rows.values[:, ::-1], rows.corner[::-1], rows.flag[::-1], rows.total_pixels)))
    return followed


def _with_earlier(rows: Rows, earlier: list[tuple[int, Rows]]) -> Rows:
    for i, before in earlier:
        k = len(before.flag)
        rows.values[:, :k, i] = before.values[..., 0]
        rows.corner[:k, i] = before.corner[:, 0]
        rows.flag[:k, i] = before.flag[:, 0] & ~RECOVERED
    return rows


def _late_comers(
    tracker: Tracker,
    samples: Sequence[Sample],
    backgrounds: dict[int, NDArray[Any]],
    detection: Detection,
    waiting: list[int],
) -> list[int]:
    """Give trails that began in these samples to targets that nobody has seen yet; returns who still waits."""
    samples = samples[-MEMORY:]
    known = tracker.last_positions(len(samples))
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


def _tell_scatter(diagnostics: dict[str, Any], seen: Scatter, names: list[str]) -> None:
    for i, name in enumerate(names):
        x, y = seen.factor[:, i]
        diagnostics["targets"][name]["sd_grown"] = {"x": float(x), "y": float(y)}
        if seen.rough[i]:
            diagnostics["problems"].append(
                f"{name}: its track scatters {np.nanmax(seen.track[:, i]):.0f} times as much as noise and contrast "
                f"explain, its light {max(seen.light[i], 1.0):.1f} times: it shakes, is blurred, or pictures repeat. "
                "Its sd_x, sd_y are grown by the latter only."
            )
    if names:
        x, y = np.median(seen.factor, axis=1)
        diagnostics["sd"] = (
            f"sd grown by {x:.2f} in X, {y:.2f} in Y: so much more do the tracks scatter than noise "
            "and contrast explain (median of the targets)"
        )


def _table(rows: Rows, moment: _Moments, names: list[str], starts: Starts, info: VideoInfo) -> DataFrame:
    from pandas import DataFrame, Series

    k, n = rows.flag.shape
    x, y, sd_x, sd_y, pixels, mass, contrast, background = (values.ravel() for values in rows.values)
    clock = info.time.fitted(moment.time[moment.offset == 0])
    time_s = clock.seconds(moment.time, fields=moment.offset)
    labels = clock.labels(moment.time).astype(object)

    def each(values: NDArray[Any]) -> NDArray[Any]:
        return np.repeat(values, n)

    def words(of: Sequence[str] | NDArray[Any], which: NDArray[np.intp]) -> Any:
        return Series(np.array(of, object)).array.take(which)  # many rows share a word: quicker than one by one

    kinds = np.arange(1 << len(FLAGS))
    field, fields = np.unique(moment.field.astype(str), return_inverse=True)
    return DataFrame(
        {
            "frame": each(moment.frame),
            "field": words(field, each(fields)),
            "time_s": each(time_s),
            "timecode": words(labels, each(np.arange(k))),
            "target": words(names, np.tile(np.arange(n), k)),
            "Xf": x,
            "Yf": y,
            "sd_x": sd_x,
            "sd_y": sd_y,
            "pixels": pixels,
            "total_pixels": each(rows.total_pixels),
            "mass": mass,
            "contrast": contrast,
            "background": background,
            "box_x": rows.corner[..., 0].ravel(),
            "box_y": rows.corner[..., 1].ravel(),
            "box_w": np.tile(starts.box[:, 0], k),
            "box_h": np.tile(starts.box[:, 1], k),
            "flag": words(described(kinds, FLAGS), rows.flag.ravel()),
        }
    )


def _diagnosed(rows: Rows, moment: _Moments, names: list[str], tracker: Tracker, info: VideoInfo) -> dict[str, Any]:
    """Pixel locking, pixel counts, what was lost and why, and pieces of pictures at the worst moments."""
    problems: list[str] = []
    measured = present(rows).mean(axis=0) if len(rows.flag) else np.zeros(len(names))
    counts, share = pixel_counts(rows.values[PIXELS]), shares(rows.flag, FLAGS)
    each = {
        name: {
            "measured": float(measured[i]),
            "flags": {word: float(values[i]) for word, values in share.items() if values[i]},
            "pixels": {word: float(values[i]) for word, values in counts.items()},
        }
        for i, name in enumerate(names)
    }
    total = {word: float(values[0]) for word, values in pixel_counts(rows.total_pixels[:, None]).items()}
    if set(moment.field) == {"top", "bottom"}:
        problems += _fields_checked(rows, moment)
    return {
        "samples": len(rows.flag),
        "measured": float(measured.mean()) if len(names) else 0.0,
        "targets": each,
        "total_pixels": total,
        "pixel_locking": {"x": pixel_locking(rows.values[X]), "y": pixel_locking(rows.values[Y])},
        "worst": [
            {
                "frame": int(moment.frame[crop.sample]),
                "field": str(moment.field[crop.sample]),
                "target": names[crop.target],
                "flag": str(described(np.array(crop.flag), FLAGS)),
                "picture": crop.picture,
            }
            for crop in tracker.recovery.crops
        ],
        "problems": problems,
    }


def _fields_checked(rows: Rows, moment: _Moments) -> list[str]:
    """A line when the tracks themselves contradict the order of fields that was used."""
    where = rows.values[:2].transpose(1, 2, 0)
    order = str(moment.field[0])
    top, bottom = (where[moment.field == name] for name in ("top", "bottom"))
    motion = order_from_motion(top, bottom)
    if motion.order in ("unknown", order):
        return []
    return [
        f"fields: {order} first was used, but the tracks say {motion.order} "
        f"(slope {motion.slope:+.2f} +- {motion.sd:.2f}). Set detect.fields to {motion.order}."
    ]
