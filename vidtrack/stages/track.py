"""Track: follow every target of a run through one camera's recording.

with open_video("runs/toss/cam1.mp4") as video:
    tracked = track(video.frames(ahead=True), video.info, targets=["ball"])
tracked.centroids[["time_s", "Xf", "Yf"]]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.association.tracklets import COLUMNS
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.memory import PagesAhead, give_back_memory, keep_freed_memory, tables_from_c_library
from vidtrack.side_by_side import both, side_by_side
from vidtrack.timing.excerpt import between
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.backdrop.still_wall import behind_targets
from vidtrack.tracking.backwards import Earlier
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.static_clutter import static_clutter
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.following.track_cuts import CutTracks, cut_tracks
from vidtrack.tracking.initiation.clip import OPENING, Clip, DetectSettings, batches
from vidtrack.tracking.initiation.starts import begun_in_boxes, begun_without_boxes, late_comers, named_boxes
from vidtrack.tracking.outlines.lighting import light_record, lighting, lit_findings
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures, kept_others, without_damaged
from vidtrack.tracking.pictures.frame_times import Moments, Stamps, chosen_clock, sample_moments
from vidtrack.tracking.pictures.mixed_pictures import lateness_of_mixed, mixed_pictures
from vidtrack.tracking.pictures.picture_order import order_findings
from vidtrack.tracking.pictures.repeats import RepeatedPictures, with_resting
from vidtrack.tracking.quality.assessment import damaged_pictures, line, missing_targets, repeated_pictures, scattering
from vidtrack.tracking.quality.besides_targets import more_than_asked, still_findings
from vidtrack.tracking.quality.track_record import diagnosed, record_scatter
from vidtrack.tracking.quality.tracking_quality import described
from vidtrack.tracking.state import BACKGROUND, CONTRAST, FLAGS, MEASURED, PIXELS, SD_X, SD_Y, Rows, Starts, X, Y
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.uncertainty.sd_scaling import grow_sd, others_with_grown_sd
from vidtrack.tracking.uncertainty.shape_change import shape_evidence
from vidtrack.tracking.windows import COLUMNS as WINDOW_COLUMNS
from vidtrack.tracking.windows import Window, lit_pieces

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Pictures:
    """How many pictures are held in memory.

    held_bytes  at most, at the beginning, where targets are searched in them
    searched    frames, at most, in which targets are searched where too little moves in the first few
    at_once     frames given to the tracker
    kept_bytes  of freed memory that are kept for what comes after the last picture, where rows take no more than that
    """

    held_bytes: int = 64_000_000
    searched: int = 48
    at_once: int = 4
    kept_bytes: int = 32_000_000


PICTURES = Pictures()

CENTROIDS = (
    *("frame", "field", "time_s", "timecode", "target", "Xf", "Yf", "sd_x", "sd_y", "pixels", "total_pixels"),
    *("mass", "contrast", "background", "box_x", "box_y", "box_w", "box_h", "flag"),
)
"""Columns of the table of centroids, as `track` says."""
_MEASURED = "Xf", "Yf", "sd_x", "sd_y", "pixels", "mass", "contrast", "background"


class Tracked(NamedTuple):
    """What the stage gives.

    centroids    one row a sample and target, as `track` says
    tracklets    one row a measured sample of all that was followed, `association.tracklets.COLUMNS`
    windows      pieces of pictures for a second search, `tracking.windows.COLUMNS`
    diagnostics  plain values, pictures under `worst`; findings: what the user should know
    clock        the recording's, as its time stamps and tracks show it
    """

    centroids: DataFrame
    tracklets: DataFrame
    windows: DataFrame
    diagnostics: dict[str, Any]
    findings: list[Finding]
    clock: TimeBase


def track(
    frames: Iterable[Frame],
    info: VideoInfo,
    *,
    targets: int | Sequence[str] | Literal["all"] = 1,
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
    max_step: float = Detection.max_step,
    min_motion: float = Detection.min_motion,
    max_clutter: float = Detection.max_clutter,
    max_occlusion: int = Detection.max_occlusion,
    damage: DamagedPictures | None = None,
) -> Tracked:
    """Follow targets through a recording.

    frames       in order of time; their pictures must last while the next ones are read (those of `open_video` do)
    targets      how many (named t1, t2, ...), or their names; all: those in start boxes, else as many as move in the
                 opening; what else is seen, then or later, is in the tracklets as always
    start_boxes  target, Xf, Yf and where they differ from `box` width, height, px: where each target is in the first
                 sample. None: targets are found by motion, or else by brightness, and named from top to bottom, left
                 to right
    threshold    grey level 0-255 on any depth; auto: half-way between each target and its own background
    fields       auto: as the motion and the flags say; frame: whole frames; top, bottom: the field that comes first
    start, end   frame number or time code of the first and the last sample used
    damage       what the frames have passed, as they were read; None: they are looked at here
    gain, offset as `stretch` has them (levels are stretched); others as `Detection`

    The table has frame, field, time_s (camera clock of the time code, not corrected), timecode, target, Xf, Yf, sd_x,
    sd_y (px, from noise and contrast, grown as `scatter` finds), pixels, total_pixels, mass, contrast, background
    (grey levels), box_x, box_y (px, the box's left top corner), box_w, box_h, flag. A target that was not measured has
    NaN and a flag that says why; its box is a guess.
    Raises VidtrackError for start boxes and targets that do not match and for a `start` that leaves no frame.
    """
    every = targets == "all"
    boxes = None
    if start_boxes is not None and len(start_boxes):
        boxes = named_boxes(targets, {str(name): start_boxes[name].to_numpy() for name in start_boxes}, box)
    size = info.width * info.height * (1 if info.bits == 8 else 2)
    repeats, used = RepeatedPictures(), between(frames, info, start, end, where="detect")
    if damage is None:
        used = (damage := DamagedPictures(info.bits, codec=info.codec)).over(used)
    limits = (max_step, min_motion, max_clutter, max_occlusion)
    detect = DetectSettings(polarity, threshold, centroid, min_pixels, fields, gain, offset, *limits)
    at_once = max(1, min(PICTURES.at_once, PICTURES.held_bytes // (8 * size)))
    clip = Clip(batches(repeats.over(used), at_once), info, detect, repeats.indices, PICTURES.held_bytes // size)
    searched = max(OPENING.frames, min(PICTURES.searched, PICTURES.held_bytes // (2 * size)))
    if boxes is not None:
        names, begun = list(boxes), begun_in_boxes(clip, np.array(list(boxes.values())))
    else:
        names, begun = begun_without_boxes(clip, targets, box, searched)
    samples, (opened, _), detection = clip.samples(clip.opening), clip.shown(), clip.detection
    backgrounds = begun.backgrounds or background_of(opened, detection)
    mixed = lateness_of_mixed(opened, detection.scale, copied=damage.copied)
    static = static_clutter(opened, backgrounds, detection, begun.places, begun.contrast, alone=boxes is None)
    whole = WholePicture(backgrounds, detection, static)
    wall, pattern = behind_targets(backgrounds, opened, detection, begun.places, begun.contrast)
    tracker = Tracker(begun.starts, detection, clip.level, clutter=begun.clutter, static=static, whole=whole, wall=wall)
    tracker.follow(samples)
    earlier = Earlier(tracker, samples, searched * (1 if clip.order == "frame" else 2))
    stamps, waiting, late = Stamps(), begun.waiting, samples[-2:]
    stamps.add(clip.opening)
    clip.opening, samples, ahead = [], [], PagesAhead(8 * MEASURED * len(names), PICTURES.kept_bytes)
    for batch in clip.batches:
        samples = clip.samples(batch)
        ahead.touch(len(samples))
        tracker.follow(samples)
        earlier.add(tracker, samples)
        pattern.prepare(tracker.rows, samples)
        stamps.add(batch)
        if waiting:
            tracker.finish()
            waiting = late_comers(tracker, samples, backgrounds, detection, waiting)
    tracker.finish()
    moment = sample_moments(stamps, clip.order)
    lines = len(set(moment.offset))
    rows, others = earlier.into(tracker, lines), earlier.others(tracker)
    pieces, crops, widths, looks = tracker.windows.kept, tracker.crops, tracker.widths, tracker.looks
    spread = tracker.spread
    del tracker, earlier, stamps, ahead  # what was recorded is as large as each table
    if few := rows.values.nbytes < PICTURES.kept_bytes:
        keep_freed_memory(PICTURES.kept_bytes)
    else:
        give_back_memory()
    clock, uneven = chosen_clock(info.time, moment.time[::lines], rows, lines)
    elapsed = clock.seconds(moment.time) - clock.seconds(0.0) if uneven else moment.time
    time = lines * (elapsed * float(info.rate) + moment.offset)
    damaged = np.isin(moment.frame, list(damage.indices))
    rows = without_damaged(with_resting(rows, np.repeat(np.array(repeats.flags, bool), lines), lines), damaged)
    pattern.take_off(rows, 1 * (moment.field == "bottom"), samples or late)
    shapes = shape_evidence(rows.values, time, lines, mixed=mixed, columns=info.rotation in (90, 270))
    lit = None if shapes.blur.late else lighting(widths.pieces(rows.values, lines), detection.noise, lines=lines)
    noise = grow_sd(rows, time, shapes, *looks, lines=lines, kind=centroid, copied=damage.copied, lit=lit)
    others = others_with_grown_sd(kept_others(others, damaged), rows, time, noise, shapes, lines=lines, lit=lit)
    columns = _Columns(moment, clock)
    cut, order = both(partial(cut_tracks, rows, others), partial(order_findings, rows, moment.field, columns.time_s))
    seen, blur, grown = noise.seen, shapes.blur, np.median(noise.seen.factor, axis=1) if names else np.ones(2)
    del others, shapes, time, elapsed, noise, looks
    diagnostics = diagnosed(rows, moment.frame, moment.field, names, crops) | clip.as_record() | damage.as_record()
    diagnostics |= blur.as_record() | light_record(lit, widths.pieces(rows.values, lines), detection.noise, lines=lines)
    diagnostics |= {"begun": begun.how, "widths": widths.as_record(names, columns.time_s, lit)}
    record_scatter(diagnostics, seen, names)
    found = [
        *scattering(seen, names),
        *missing_targets(rows, names, begun.expected, detection),
        *([] if every else more_than_asked(cut, len(rows.flag), len(names), chosen=boxes is not None)),
        *still_findings(spread, rows.values, names, detection, chosen=boxes is not None),
        *order,
        *uneven,
        *mixed_pictures(blur.late, blur.drawn),
        *repeated_pictures(repeats.flags, rows),
        *damaged_pictures(damage.indices),
        *lit_findings(lit),
    ]
    table = _table(rows, columns, names, begun.starts)
    del rows, crops, widths  # each table is as large as what was recorded
    if not few:
        give_back_memory()
    tracklets = _tracklet_table(cut, columns, names, boxes is not None)
    pieces = sorted((one for one in pieces if not damaged[one.sample]), key=lambda one: one.sample)
    alike = {"noise": detection.noise, "grown_x": grown[0], "grown_y": grown[1], "exposure": blur.exposure}
    windows = _window_table(pieces, columns, alike | lit_pieces(pieces, lit))
    diagnostics["problems"] = [line(finding) for finding in found]
    keep_freed_memory(PICTURES.kept_bytes // 8)
    give_back_memory()
    return Tracked(table, tracklets, windows, diagnostics, found, clock)


def untracked(frames: Iterable[Frame], info: VideoInfo, damage: DamagedPictures) -> Tracked:
    """A recording of which no target is followed: its frames, which `damage` looks at, are read, its tables are empty.

    Raises VidtrackError where there is no frame.
    """
    from pandas import DataFrame

    if not (n := sum(1 for _ in frames)):
        raise VidtrackError("the recording has no frame to track in. Give one that has.")
    empty = [DataFrame({name: np.zeros(0) for name in names}) for names in (CENTROIDS, COLUMNS, WINDOW_COLUMNS)]
    found = damaged_pictures(damage.indices)
    diagnostics = {"samples": n, "measured": 0.0, "targets": {}, "worst": [], "problems": [line(one) for one in found]}
    return Tracked(empty[0], empty[1], empty[2], diagnostics | damage.as_record(), found, info.time)


class _Columns:
    """The columns that say which sample a row is of; flags: the words of all flags."""

    def __init__(self, moment: Moments, clock: TimeBase) -> None:
        tables_from_c_library()
        self.frame = moment.frame
        self.time_s = clock.seconds(moment.time, fields=moment.offset)
        field, self._fields = np.unique(moment.field.astype(str), return_inverse=True)
        self._field, self._labels = _as_column(field), _as_column(clock.labels(moment.time))
        self.flags = _as_column(described(np.arange(1 << len(FLAGS)), FLAGS))

    def of(self, sample: NDArray[np.intp]) -> dict[str, Any]:
        """Those of some samples (rows,), for `_written`."""
        return {
            "frame": self.frame[sample],
            "field": _Words(self._field, lambda: self._fields[sample]),
            "time_s": self.time_s[sample],
            "timecode": _Words(self._labels, lambda: sample),
        }


class _Words(NamedTuple):
    """A column of words that is not written out yet: the words, and what says which of them each row has."""

    words: Any
    which: Callable[[], NDArray[np.intp]]


def _written(columns: dict[str, Any], names: Sequence[str]) -> DataFrame:
    """The table of those columns that are named, words written out side by side."""
    from pandas import DataFrame

    words = {name: columns[name] for name in names if isinstance(columns[name], _Words)}
    written = side_by_side(lambda column: column.words.take(column.which()), list(words.values()))
    columns = columns | dict(zip(words, written, strict=True))
    return DataFrame({name: columns[name] for name in names}, copy=False)


def _as_column(words: Sequence[str] | NDArray[Any]) -> Any:
    """Words as pandas keeps them, in a fifth of the memory of as many objects; rows of a table take theirs of them."""
    from pandas import Series

    return Series(np.array(words, object)).array


def _table(rows: Rows, columns: _Columns, names: list[str], starts: Starts) -> DataFrame:
    k, n = rows.flag.shape
    return _written(
        {
            **columns.of(np.repeat(np.arange(k), n)),
            "target": _Words(_as_column(names), lambda: np.tile(np.arange(n), k)),
            **dict(zip(_MEASURED, (values.ravel() for values in rows.values[: BACKGROUND + 1]), strict=True)),
            "total_pixels": np.repeat(rows.total_pixels, n),
            "box_x": rows.corner[..., 0].ravel(),
            "box_y": rows.corner[..., 1].ravel(),
            "box_w": np.tile(starts.box[:, 0], k),
            "box_h": np.tile(starts.box[:, 1], k),
            "flag": _Words(columns.flags, rows.flag.ravel),
        },
        CENTROIDS,
    )


def _tracklet_table(cut: CutTracks, columns: _Columns, names: list[str], in_boxes: bool) -> DataFrame:
    """The table of tracklets; in_boxes: the user has named where each target begins."""
    each = cut.tracklet
    table = {
        **columns.of(cut.sample),
        "tracklet": each,
        "Xf": cut.values[X],
        "Yf": cut.values[Y],
        "sd_x": cut.values[SD_X],
        "sd_y": cut.values[SD_Y],
        "pixels": cut.values[PIXELS],
        "brightness": cut.values[CONTRAST],
        "flag": _Words(columns.flags, lambda: cut.flag),
        "began": _Words(_as_column(cut.began), lambda: each),
        "ended": _Words(_as_column(cut.ended), lambda: each),
        "met": _Words(_as_column(cut.met), lambda: each),
        "target": _Words(_as_column([*names, ""]), lambda: cut.target[each]),
        "bound": (in_boxes & (cut.began == "first") & (cut.target >= 0))[each],
    }
    return _written(table, COLUMNS)


def _window_table(kept: Sequence[Window], columns: _Columns, alike: Mapping[str, float | Array]) -> DataFrame:
    """The table of pieces of pictures, in order of time; alike: what is the same in all, or (kept,) values."""
    sample = np.array([one.sample for one in kept], np.intp)
    table = columns.of(sample) | {
        **{key: np.array([getattr(one, key) for one in kept], np.int64) for key in ("left", "top", "parity", "lines")},
        "width": np.array([one.grey.shape[1] for one in kept], np.int64),
        "grey": np.array([one.grey.tobytes() for one in kept], object),
        **{name: np.broadcast_to(value, len(kept)).copy() for name, value in alike.items()},
    }
    return _written(table, WINDOW_COLUMNS)
