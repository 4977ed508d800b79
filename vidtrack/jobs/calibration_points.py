"""Job calibration_points: a camera's clips, the survey and the picks in; sightings, a picture and the record out.

Where a camera's points cannot be found or named, the job ends well all the same, with no sightings and the reasons in
its record: the survey is then judged by the other cameras, which are calibrated, and whatever needs this camera fails
with those reasons (`files.labelling_json`).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pandas as pd

from vidtrack.errors import VidtrackError
from vidtrack.files.records import GREY_LEVEL, write_json, write_png
from vidtrack.files.tables import read_parquet, read_picks, read_points, write_parquet
from vidtrack.findings import Finding, as_records
from vidtrack.progress import Progress
from vidtrack.stages.calibration_points import calibration_points, compared, no_sightings, picks_from_before
from vidtrack.steadiness.bars import bars_record
from vidtrack.timing.excerpt import between
from vidtrack.timing.frame import Frame
from vidtrack.video.reader import open_video
from vidtrack.video.recording import Video
from vidtrack.video.times.time_source import find_time
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Inputs points, videos (as settings["clips"]), picks (as picks_clips).

    Outputs sightings, picture, background, record.

    Input before, optional: the sightings of the clips from before the test, to name those from after it.
    """
    try:
        _label(job)
    except VidtrackError as error:
        _write_nothing(job, error.problems)


def _write_nothing(job: Job, problems: Sequence[str]) -> None:
    """No sightings, a black pixel for each picture, and why."""
    units, provenance = job.settings.get("units", ""), job.provenance
    write_parquet(job.outputs["sightings"], no_sightings(), units=units, provenance=provenance)
    write_png(job.outputs["picture"], np.zeros((1, 1), np.uint8))
    write_png(job.outputs["background"], np.zeros((1, 1), np.uint16))
    findings = [Finding("failed", "calibration-points-failed", problem) for problem in problems]
    write_json(job.outputs["record"], {"failed": list(problems), "findings": as_records(findings)}, provenance)


def _label(job: Job) -> None:
    camera, clips = job.settings["camera"], job.settings["clips"]
    points = read_points(job.path("points"), job.settings.get("units", ""))
    picks = _picks(job)
    with ExitStack() as stack:
        videos = {
            clip: stack.enter_context(open_video(path, threads=job.threads, **own.get("recording", {})))
            for (clip, own), path in zip(clips.items(), job.paths("videos"), strict=True)
        }
        found = calibration_points(
            {clip: _frames(video, clip, job) for clip, video in videos.items()},
            points,
            picks,
            camera=camera,
            tags={clip: own["tags"] for clip, own in clips.items()},
            detect={clip: own.get("detect", {}) for clip, own in clips.items()},
            bits={clip: video.info.bits for clip, video in videos.items()},
            sigma=job.settings.get("sigma", 0.0),
        )
        pictures = {clip: video.info.shape | bars_record(found.means.get(clip)) for clip, video in videos.items()}
        troubles = [f"calibration/{clip}/{camera}: {p}" for clip, v in videos.items() for p in v.account.problems]
    for warning in (*troubles, *found.warnings):
        sys.stderr.write(f"warning: {warning}\n")
    units, provenance = job.settings.get("units", ""), job.provenance
    write_parquet(job.outputs["sightings"], found.table, units=units, provenance=provenance)
    write_png(job.outputs["picture"], found.picture)
    first, background = next(iter(found.means.items()))
    write_png(job.outputs["background"], np.rint(np.clip(background, 0, 255) * GREY_LEVEL).astype(np.uint16))
    record = {"reading": troubles, "pictures": pictures, "background": {"clip": first}, **compared(found, camera)}
    write_json(job.outputs["record"], found.record | record, provenance)


def _picks(job: Job) -> pd.DataFrame | None:
    """Picks of all clips; for clips filmed after the test, without any, where the balls were before it."""
    parts = []
    for clip, path in zip(job.settings.get("picks_clips", []), job.paths("picks"), strict=True):
        table = read_picks(path, job.settings["camera"])
        if len(table):
            parts.append(table.assign(clip=clip, file=path))
    if not parts and job.paths("before"):
        tags = {clip: own["tags"] for clip, own in job.settings["clips"].items()}
        return picks_from_before(read_parquet(job.path("before")), tags, job.path("before"))
    return pd.concat(parts, ignore_index=True) if parts else None


def _frames(video: Video, clip: str, job: Job) -> Iterator[Frame]:
    """The frames of a clip that the config asks for, counted on the terminal."""
    detect = job.settings["clips"][clip].get("detect", {})
    where = f"calibration.clips.{clip}.detect"
    ends = detect.get("start"), detect.get("end")
    info = video.info
    if any(isinstance(end, str) for end in ends):  # a time code: the clip's clock may lie on its sound track
        info = replace(info, time=find_time(video.path, info).base)
    frames = between(video.frames(), info, *ends, where=where)
    with Progress(f"calibration_points {clip}/{job.settings['camera']}", video.info.n_expected, "frames") as shown:
        yield from shown.over(frames)
