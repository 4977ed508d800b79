"""Everything that `vidtrack check` says of an experiment: facts, and findings worst first."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Experiment, Run, target_names
from vidtrack.findings import Finding
from vidtrack.geometry.picture_part import Picture
from vidtrack.preview.boards import board_in_clips
from vidtrack.preview.digitised import camera_in_file, points_in_files, tracks_in_file
from vidtrack.preview.pictures import other_pictures, picture_of
from vidtrack.preview.recordings import LIMITS, Opening, Recording, Target, look_at, targets_in, track_opening
from vidtrack.preview.views import Few, View, opened_with, view_of
from vidtrack.settings.config import Settings
from vidtrack.video.reader import open_video
from vidtrack.workflow import orders
from vidtrack.workflow.boarded import board_clips

if TYPE_CHECKING:
    from pandas import DataFrame

FRAMES = 60
"""Frames of each run that are tracked."""

CLIP_FRAMES = 8
"""Frames of each calibration clip that are averaged."""

FIELDS = {
    "progressive": "whole frames",
    "top": "interlaced, the top field first",
    "bottom": "interlaced, the bottom field first",
    "unknown": "whole frames (the file does not say)",
}
"""What is said of the fields of a recording."""

JOB_SECONDS = 3.0
"""ASSUME: what a small job takes, mostly its start."""
START_MISS = 3.0
"""px: more than centroids and calibrations leave between lines of sight; they meet at no place then."""

SAMPLE_BYTES = 160
"""Results a sample, target and camera, measured on the demo; and as much again for each in space."""


class Facts(NamedTuple):
    """facts: (about what, what); findings: what a person should know."""

    facts: list[tuple[str, str]]
    findings: list[Finding]

    def say(self, about: str, what: str) -> None:
        """Add a fact."""
        self.facts.append((about, what))

    def warn(self, level: str, code: str, text: str, cure: str = "") -> None:
        """Add a finding; level failed: the workflow would refuse."""
        self.findings.append(Finding(level, code, text, cure))  # type: ignore[arg-type]


def survey(settings: Settings, experiment: Experiment, cores: int, tick: Callable[[str], None]) -> Facts:
    """Look at every recording and say what will come of it.

    tick   called with what is looked at next
    """
    found = Facts([], [])
    views: dict[str, View] = {}
    pictures: dict[str, Picture] = {}
    digitised = {camera for clip in experiment.clips.values() for camera in clip.digitised}
    for camera in experiment.given:
        _file(f"calibration, {camera}", found, partial(camera_in_file, settings, experiment, camera))
    for camera in experiment.cameras_in_clips():
        if camera in experiment.given:
            continue
        if camera in digitised:  # there is no picture to look at
            _file(f"calibration, {camera}", found, partial(points_in_files, settings, experiment, camera))
            continue
        tick(f"calibration of {camera}")
        views[camera] = _calibration(settings, experiment, camera, found, pictures)
    work = 0.0
    size = 0.0
    for name, run in experiment.runs.items():
        seen: dict[str, Recording] = {}
        openings: dict[str, Opening] = {}
        for camera in run.videos:
            if camera in run.tracks:
                read = partial(tracks_in_file, settings, experiment, name, camera)
                _file(f"run {name}, {camera}", found, read)
                continue
            tick(f"run {name}, {camera}")
            _recording(settings, experiment, run, camera, found, seen, openings)
        _times(name, seen, found)
        found.findings.extend(other_pictures(settings, name, pictures, {c: look.info for c, look in seen.items()}))
        mode = settings.runs[name].mode if name in settings.runs else "space"
        if mode == "space":
            _space(settings, run, views, openings, found)
        work += sum(seen[c].frames * openings[c].seconds for c in openings) + 4 * JOB_SECONDS
        targets = max((len(o.centroids["target"].unique()) for o in openings.values()), default=1)
        size += sum(seen[c].frames for c in seen) * targets * 2 * SAMPLE_BYTES + 1e6
    _cost(experiment, work, size, len(views), cores, found)
    return found


def _file(about: str, found: Facts, read: Callable[[], str]) -> None:
    """What a file of another program holds, or why it would be refused."""
    try:
        found.say(about, read())
    except VidtrackError as error:
        for problem in error.problems:
            found.warn("failed", "file-refused", f"{about}: {problem}")


def _calibration(
    settings: Settings, experiment: Experiment, camera: str, found: Facts, pictures: dict[str, Picture]
) -> View:
    def read(clip: str, path: str, how: Mapping[str, Any]) -> Few:
        with open_video(path, **how) as video:
            frames = [frame._replace(luma=np.array(frame.luma)) for frame in islice(video.frames(), CLIP_FRAMES)]
            pictures[camera] = picture_of(video.info)
            return Few(frames, (video.info.width, video.info.height), video.info.bits)

    view = view_of(settings, experiment, camera, read)
    about = f"calibration, {camera}"
    for problem in view.problems:
        found.warn("failed", "calibration-refused", f"{about}: {problem}")
    if view.later:
        found.say(about, f"calibrated by {view.later}; the run says how well")
        if not view.problems and board_clips(settings, experiment, camera):
            _board(settings, experiment, camera, about, found)
    if view.sightings is not None:
        table = view.sightings.table
        seen = table[table["found"]]
        sizes = np.sqrt(4 * seen["pixels"] / np.pi)
        found.say(about, f"{len(seen)} of {len(table)} listed points in view, {sizes.median():.1f} px wide")
        if len(seen) < len(table):
            missing = table[~table["found"]]
            first = ", ".join(f"{tag} ({why})" for tag, why in zip(missing["tag"][:3], missing["reason"], strict=False))
            found.warn("note", "points-missing", f"{about}: {len(missing)} listed points are not found: {first}")
        for warning in view.sightings.warnings:
            found.warn("doubtful", "calibration-points", f"{about}: {warning}")
    if view.calibration is not None:
        record, where = view.calibration.record, view.calibration.camera.position
        at = ", ".join(f"{v:.3g}" for v in where)
        found.say(about, f"{record['rms_px']:.3f} px rms of {record['n_points']} points; it stands at ({at})")
        found.findings.extend(f._replace(text=f"{about}: {f.text}") for f in view.calibration.findings)
    return view


def _board(settings: Settings, experiment: Experiment, camera: str, about: str, found: Facts) -> None:
    try:
        seen = board_in_clips(settings, experiment, camera)
    except VidtrackError as error:
        for problem in error.problems:
            found.warn("failed", "recording-refused", f"{about}: {problem}")
        return
    if seen.said:
        found.say(about, seen.said)
    found.findings.extend(f._replace(text=f"{about}: {f.text}") for f in seen.findings)


def _recording(
    settings: Settings,
    experiment: Experiment,
    run: Run,
    camera: str,
    found: Facts,
    seen: dict[str, Recording],
    openings: dict[str, Opening],
) -> None:
    about, path = f"run {run.name}, {camera}", run.videos[camera]
    own = settings.runs.get(run.name)
    try:
        how = opened_with(settings, experiment, "run", run.name, camera)
        look = look_at(path, how, start_timecode=own.start_timecode if own else None)
        seen[camera] = look
        info = look.info
        time = f"time code ({info.time.source})" if info.time.anchors else "no time code"
        found.say(
            about,
            f"{info.codec}, {info.width} x {info.height}, {float(info.rate):.5g} a second, {look.frames} frames, "
            f"{look.seconds:.1f} s, {FIELDS[info.field_order]}, {time}",
        )
        for problem in look.time.problems:
            found.warn("doubtful", "time-code", f"{about}: {problem}")
        if own and own.mode == "waterline":
            return
        order = orders.track(settings, experiment, run.name, camera)
        boxes = _boxes(run, camera, (info.width, info.height))
        openings[camera] = opening = track_opening(path, look.time, order, boxes, FRAMES, how)
    except VidtrackError as error:
        for problem in error.problems:
            found.warn("failed", "recording-refused", f"{about}: {problem}")
        return
    noise = float(np.median([light.noise for light in look.light]))
    targets = targets_in(opening.centroids)
    for target in targets[:12]:
        _target(about, target, noise, float(info.rate) * (2 if _in_fields(opening) else 1), found)
    if len(targets) > 12:
        found.say(about, f"and {len(targets) - 12} more targets")
    found.findings.extend(f._replace(text=f"{about}, first {FRAMES} frames: {f.text}") for f in opening.findings)


def _in_fields(opening: Opening) -> bool:
    return bool((opening.centroids["field"] != "frame").any())


def _boxes(run: Run, camera: str, size: tuple[int, int]) -> DataFrame | None:
    from vidtrack.files.tables import read_targets

    return read_targets(run.targets, camera, size) if run.targets else None


def _target(about: str, target: Target, noise: float, rate: float, found: Facts) -> None:
    who = f"{about}: target {target.name}"
    if not target.measured:
        found.warn(
            "doubtful", "target-unseen", f"{who} is not measured in the first {FRAMES} frames",
            "Draw its start box (vidtrack pick), correct polarity or threshold, or light it.",
        )  # fmt: skip
        return
    found.say(
        about,
        f"{target.name}: {target.diameter:.1f} px wide, {target.contrast:.0f} grey levels over noise of {noise:.1f}, "
        f"centroid to {target.sd:.3f} px, measured in {target.measured:.0%} of the first {FRAMES} frames",
    )
    if target.contrast < LIMITS.contrast or target.contrast < LIMITS.over_noise * noise:
        found.warn(
            "doubtful", "contrast-low", f"{who} rises {target.contrast:.0f} grey levels above noise of {noise:.1f}",
            "Light it more, open the iris or lower the gain; the background darker.",
        )  # fmt: skip
    if target.saturated > LIMITS.saturated:
        found.warn(
            "note", "saturated", f"{who} is saturated in {target.saturated:.0%} of the samples: its rim is clipped",
            "Close the iris or shorten the exposure; detect.centroid: ellipse suffers less.",
        )  # fmt: skip
    if np.pi * target.diameter**2 / 4 < LIMITS.pixels:
        found.warn(
            "doubtful", "target-small", f"{who} has {np.pi * target.diameter**2 / 4:.0f} pixels",
            "Make it larger, or bring the camera nearer: 5 px across is good.",
        )  # fmt: skip
    if target.period is None:
        need = LIMITS.samples / rate
        found.say(about, f"{target.name}: no period seen; {LIMITS.samples:.0f} samples a period from {need:.2g} s on")
        return
    samples = rate * target.period
    found.say(about, f"{target.name}: period {target.period:.3g} s, {samples:.0f} samples each")
    if samples < LIMITS.samples:
        found.warn(
            "note", "samples-few", f"{who}: {samples:.0f} samples a period of {target.period:.3g} s; "
            f"{LIMITS.samples:.0f} are asked of data for validation",
            f"Film at {LIMITS.samples / target.period:.0f} a second or more, if you need them.",
        )  # fmt: skip


def _times(run: str, seen: Mapping[str, Recording], found: Facts) -> None:
    """Whether the recordings of a run's cameras overlap in time."""
    coded = {c: look for c, look in seen.items() if look.info.time.anchors}
    if len(seen) < 2:
        return
    if coded and len(coded) < len(seen):
        rest = ", ".join(c for c in seen if c not in coded)
        found.warn(
            "doubtful", "time-code-missing", f"run {run}: {rest} has no time code, the others have",
            f"Give runs.{run}.start_timecode or cameras.<camera>.clock.",
        )  # fmt: skip
    if not coded:
        found.say(f"run {run}", "no camera has a time code: clocks are estimated from the motion (or sound, flash)")
        return
    spans = {c: (float(k.info.time.seconds(0.0)), float(k.info.time.seconds(k.seconds))) for c, k in coded.items()}
    start, end = max(a for a, _ in spans.values()), min(b for _, b in spans.values())
    if end <= start:
        found.warn(
            "failed", "no-common-time", f"run {run}: by their time codes the cameras share no moment",
            "Is it the right recording of each camera? Correct start_timecode or clock.offset_s.",
        )  # fmt: skip
    else:
        found.say(f"run {run}", f"all cameras share {end - start:.1f} s by their time codes")


def _space(
    settings: Settings, run: Run, views: Mapping[str, View], openings: Mapping[str, Opening], found: Facts
) -> None:
    """Accuracy where the points are, and whether targets start among them."""
    from vidtrack.preview.space import expected

    known = {c: v for c in openings if (v := views[c].calibration if c in views else None) is not None}
    if len(known) < 2:
        return
    names = target_names(settings, run)
    named = names if run.targets or len(names) == 1 else []
    answer = expected(known, {c: openings[c].centroids for c in known}, named)
    sigma, about = answer.sigma, f"run {run.name}"
    if np.isfinite(sigma).all():
        share = answer.field / float(np.linalg.norm(sigma))
        each = ", ".join(f"{axis} {value:.2g}" for axis, value in zip("xyz", sigma, strict=True))
        found.say(about, f"sigma to expect among the points: {each} {settings.units}, 1/{share:,.0f} of the field")
    for name, (where, outside, miss) in answer.starts.items():
        if not np.isfinite(where).all():
            found.warn("note", "start-unknown", f"{about}: where {name} starts is not located from its first samples")
        elif miss > START_MISS:
            found.warn(
                "note", "start-lines-miss",
                f"{about}: the cameras' first sights of {name} miss each other by {miss:.0f} px: they are not of one "
                "moment, or one camera's box is about another target",
                "Compare the boxes with the lines that vidtrack pick draws. The run says which it is.",
            )  # fmt: skip
        elif outside > 0:
            at = ", ".join(f"{v:.3g}" for v in where)
            found.warn(
                "doubtful", "outside-volume",
                f"{about}: {name} starts at ({at}), {outside:.3g} {settings.units} outside the volume of the points",
                "Survey points about the motion: outside of them errors grow.",
            )  # fmt: skip
        else:
            found.say(about, f"{name} starts at ({', '.join(f'{v:.3g}' for v in where)}), among the points")


def _cost(experiment: Experiment, work: float, size: float, cameras: int, cores: int, found: Facts) -> None:
    seconds = (work + 3 * JOB_SECONDS * cameras) / max(cores, 1) + 4 * JOB_SECONDS
    size += 2e6 * (cameras + 1)
    free = shutil.disk_usage(experiment.folder).free
    found.say(
        "cost", f"about {_span(seconds)} on {cores} cores, {size / 1e6:.0f} MB of results ({free / 1e9:.0f} GB free)"
    )
    if size > 0.9 * free:
        text = f"{experiment.folder}: about {size / 1e6:.0f} MB are needed, {free / 1e6:.0f} MB are free"
        found.warn("failed", "disc-full", text, "Free some space.")


def _span(seconds: float) -> str:
    return (
        f"{seconds:.0f} s"
        if seconds < 100
        else f"{seconds / 60:.0f} min"
        if seconds < 5400
        else f"{seconds / 3600:.1f} h"
    )
