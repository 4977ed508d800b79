"""Track: follow every target of a run through one camera's recording.

with open_video("runs/toss/cam1.mp4") as video:
    tracked = track(video.frames(ahead=True), video.info, targets=["ball"])
tracked.centroids[["time_s", "Xf", "Yf"]]
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from vidtrack.association.tracklets import COLUMNS
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.memory import give_back_memory, keep_freed_memory
from vidtrack.stages.track_tables import CENTROIDS, SampleColumns, centroid_table, tracklet_table, window_table
from vidtrack.timing.excerpt import between
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.assessment import (
    damaged_pictures,
    line,
    missing_targets,
    more_than_asked,
    repeated_pictures,
    scattering,
)
from vidtrack.tracking.backwards import Earlier
from vidtrack.tracking.clip import OPENING, Clip, DetectSettings, batches
from vidtrack.tracking.damaged_pictures import DamagedPictures, kept_others, without_damaged
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.static_clutter import static_clutter
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.frame_times import Stamps, chosen_clock, sample_moments
from vidtrack.tracking.measurement.lighting import lighting, lit_findings
from vidtrack.tracking.measurement.mixed_pictures import lateness_of_mixed, mixed_pictures
from vidtrack.tracking.measurement.sd_scaling import grow_sd, others_with_grown_sd
from vidtrack.tracking.measurement.shape_change import shape_evidence
from vidtrack.tracking.measurement.still_wall import behind_targets
from vidtrack.tracking.picture_order import order_findings
from vidtrack.tracking.repeats import RepeatedPictures, with_resting
from vidtrack.tracking.starts import (
    begun_anywhere,
    begun_in_boxes,
    count_movers,
    late_comers,
    named_boxes,
)
from vidtrack.tracking.track_cuts import cut_tracks
from vidtrack.tracking.track_record import diagnosed, record_scatter
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.windows import COLUMNS as WINDOW_COLUMNS

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
        targets = count_movers(clip, searched) if every else targets
        names = [f"t{i + 1}" for i in range(targets)] if isinstance(targets, int) else [str(t) for t in targets]
        begun = begun_anywhere(clip, len(names), box, searched)
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
    clip.opening, samples = [], []
    for batch in clip.batches:
        samples = clip.samples(batch)
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
    del tracker, earlier, stamps  # what was recorded is as large as each table
    give_back_memory()
    if rows.values.nbytes < PICTURES.kept_bytes:
        keep_freed_memory(PICTURES.kept_bytes)
    clock, uneven = chosen_clock(info.time, moment.time[::lines], rows, lines)
    elapsed = clock.seconds(moment.time) - clock.seconds(0.0) if uneven else moment.time
    time = lines * (elapsed * float(info.rate) + moment.offset)
    damaged = np.isin(moment.frame, list(damage.indices))
    rows = without_damaged(with_resting(rows, np.repeat(np.array(repeats.flags, bool), lines), lines), damaged)
    pattern.take_off(rows, 1 * (moment.field == "bottom"), samples or late)
    shapes = shape_evidence(rows.values, time, lines, mixed=mixed, columns=info.rotation in (90, 270))
    lit = lighting(widths.pieces(len(names)), detection.noise, lines=lines)
    noise = grow_sd(rows, time, shapes, *looks, lines=lines, kind=centroid, copied=damage.copied, lit=lit)
    others = others_with_grown_sd(kept_others(others, damaged), rows, time, noise, shapes, lines=lines, lit=lit)
    cut = cut_tracks(rows, others)
    seen, blur, grown = noise.seen, shapes.blur, np.median(noise.seen.factor, axis=1) if names else np.ones(2)
    del others, shapes, time, elapsed, noise, looks
    columns = SampleColumns(moment, clock)
    diagnostics = diagnosed(rows, moment.frame, moment.field, names, crops) | clip.as_record() | damage.as_record()
    diagnostics |= {"lighting": lit.as_record()} if lit else {}
    diagnostics |= {"begun": begun.how, "widths": widths.as_record(names, columns.time_s, lit)} | blur.as_record()
    record_scatter(diagnostics, seen, names)
    found = [
        *scattering(seen, names),
        *missing_targets(rows, names, begun.expected, detection),
        *([] if every else more_than_asked(cut, len(rows.flag), len(names), chosen=boxes is not None)),
        *order_findings(rows, moment.field),
        *uneven,
        *mixed_pictures(blur.late, blur.drawn),
        *repeated_pictures(repeats.flags, rows),
        *damaged_pictures(damage.indices),
        *lit_findings(lit),
    ]
    table = centroid_table(rows, columns, names, begun.starts)
    del rows, crops, widths  # each table is as large as what was recorded
    give_back_memory()
    tracklets = tracklet_table(cut, columns, names, boxes is not None)
    pieces = [one for one in pieces if not damaged[one.sample]]
    windows = window_table(pieces, columns, detection.noise, grown, blur.exposure, lit)
    diagnostics["problems"] = [line(finding) for finding in found]
    keep_freed_memory(PICTURES.kept_bytes // 8)
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
