"""Track the targets of a run in one camera: video in, centroids and an account of the reading out."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.files.records import write_json
from vidtrack.files.tables import read_targets, write_parquet
from vidtrack.findings import as_records
from vidtrack.progress import Progress
from vidtrack.stages.track import track
from vidtrack.timing.frame import ReadAccount, VideoInfo
from vidtrack.timing.light import LightMeter
from vidtrack.timing.run_scale import code_as_record
from vidtrack.timing.timebase import TimeBase
from vidtrack.video.account import BLANK
from vidtrack.video.reader import open_video
from vidtrack.video.time_source import find_time
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """Follow the targets; write centroids, tracklets, the record, and how bright each picture was."""
    settings = job.settings
    camera = settings["camera"]
    with open_video(job.path("video"), threads=job.threads, **settings.get("recording", {})) as video:
        size = (video.info.width, video.info.height)
        boxes = read_targets(job.path("targets"), camera, size) if job.paths("targets") else None
        found = find_time(job.path("video"), video.info, start_timecode=settings.get("start_timecode"))
        info = replace(video.info, time=found.base)
        meter = LightMeter(info.bits)
        label = f"track {settings['run']}/{camera}"
        with Progress(label, info.n_frames_hint, "frames") as progress:
            tracked = track(
                meter.over(progress.over(video.frames(ahead=True))),
                info,
                targets=settings["targets"],
                start_boxes=boxes,
                **settings["detect"],
            )
        account = _not_refuted(video.account, tracked.diagnostics["measured"])
    record = {
        "run": settings["run"],
        "camera": camera,
        "video": _video_record(info),
        "time": {
            "source": info.time.source,
            "rate": str(info.rate),
            "drop": info.time.drop,
            "code": code_as_record(info.time.first),
            "table": [row._asdict() for row in found.table],
            "problems": found.problems,
        },
        "reading": account._asdict(),
        **tracked.diagnostics,
    }
    record["findings"] = as_records(tracked.findings)
    record["problems"] = [*found.problems, *tracked.diagnostics["problems"]]
    record["worst"] = [{**worst, "picture": _png_text(worst["picture"])} for worst in record["worst"]]
    write_parquet(job.outputs["centroids"], tracked.centroids, units="px", provenance=job.provenance)
    write_parquet(job.outputs["tracklets"], tracked.tracklets, units="px", provenance=job.provenance)
    write_json(job.outputs["record"], record, job.provenance)
    in_fields = bool((tracked.centroids["field"] != "frame").any())
    write_parquet(job.outputs["light"], _light(meter, tracked.clock, in_fields), units="px", provenance=job.provenance)


def _not_refuted(account: ReadAccount, measured: float) -> ReadAccount:
    """The account without what the centroids refute: a picture in which targets are measured is not blank."""
    if not measured:
        return account
    return account._replace(problems=tuple(line for line in account.problems if not line.startswith(BLANK)))


def _light(meter: LightMeter, clock: TimeBase, in_fields: bool) -> DataFrame:
    """Every picture that was read: when it was taken, when the middle of its one or two exposures was, its brightness.

    stamp_s counts from the first picture; time_s, middle_s are by the time code.
    """
    from pandas import DataFrame

    stamps = meter.stamps
    columns = {"frame": np.arange(len(stamps)), "stamp_s": stamps, "time_s": clock.seconds(stamps)}
    columns["middle_s"] = clock.seconds(stamps, fields=np.full(len(stamps), 0.25)) if in_fields else columns["time_s"]
    return DataFrame({**columns, "brightness": meter.levels})


def _video_record(info: VideoInfo) -> dict[str, Any]:
    return {
        "width": info.width,
        "height": info.height,
        "rate": float(info.rate),
        "sample_aspect": str(info.sample_aspect),
        "rotation": info.rotation,
        "mirrored": info.mirrored,
        "codec": info.codec,
        "pix_fmt": info.pix_fmt,
        "bits": info.bits,
        "field_order": info.field_order,
    }


def _png_text(picture: NDArray[np.uint8]) -> str:
    """A small picture as text that a page can show: base64 of a PNG."""
    return base64.b64encode(cv2.imencode(".png", picture)[1].tobytes()).decode()
