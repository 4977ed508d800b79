"""Track the targets of a run in one camera: video in, centroids and an account of the reading out."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.errors import VidtrackError
from vidtrack.files.records import GREY_LEVEL, write_json, write_png
from vidtrack.files.tables import read_targets, write_parquet
from vidtrack.findings import Finding, as_records
from vidtrack.progress import Progress, announce
from vidtrack.stages.track import Tracked, track
from vidtrack.steadiness.samples import BackgroundSamples
from vidtrack.steadiness.series import Targets, background_course
from vidtrack.timing.excerpt import between
from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo
from vidtrack.timing.lamp import LightMeter
from vidtrack.timing.run_scale import code_as_record
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.tag_reader import TagReader
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
        label = f"track {settings['run']}/{camera}"
        announce(label, phase="reading its time code")  # of a sound track: from beginning to end
        found = find_time(job.path("video"), video.info, start_timecode=settings.get("start_timecode"))
        info = replace(video.info, time=found.base)
        meter, samples = LightMeter(info.bits), BackgroundSamples()
        tags = _tag_reader(settings, info)
        with Progress(label, info.n_expected, "frames") as progress:
            frames = meter.over(samples.over(progress.over(video.frames(ahead=True))))
            if settings["targets"] == 0 and tags is not None:
                used = between(frames, info, settings["detect"]["start"], settings["detect"]["end"], where="detect")
                tracked = _untracked(tags.over(used), info)
            else:
                tracked = track(
                    frames if tags is None else tags.over(frames),
                    info,
                    targets=settings["targets"],
                    start_boxes=boxes,
                    **settings["detect"],
                )
        if tags is not None:
            tracked = _with_tags(tracked, tags, settings)
        account = _not_refuted(video.account, tracked.diagnostics["measured"])
        account = account._replace(corrupt=account.corrupt + len(tracked.diagnostics.get("damage_seen", ())))
    in_fields = bool((tracked.centroids["field"] != "frame").any())
    light = _light(meter, tracked.clock, in_fields)
    course = _course(samples, tracked, light, info.bits)
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
        "background": {"block": samples.block, "patches": int(course["patch"].nunique())},
        **tracked.diagnostics,
    }
    record["findings"] = as_records([*tracked.findings, *_of_reading(account, found.problems)])
    record["problems"] = [*found.problems, *tracked.diagnostics["problems"]]
    record["worst"] = [{**worst, "picture": _png_text(worst["picture"])} for worst in record["worst"]]
    write_parquet(job.outputs["centroids"], tracked.centroids, units="px", provenance=job.provenance)
    write_parquet(job.outputs["tracklets"], tracked.tracklets, units="px", provenance=job.provenance)
    if "windows" in job.outputs:
        columns = {"left": "px", "top": "px", "width": "px"}
        write_parquet(job.outputs["windows"], tracked.windows, units="px", provenance=job.provenance, columns=columns)
    write_json(job.outputs["record"], record, job.provenance)
    write_parquet(job.outputs["light"], light, units="px", provenance=job.provenance)
    write_parquet(job.outputs["background"], course, units="px", provenance=job.provenance)
    write_png(job.outputs["picture"], _begun(samples, info.bits))


def _tag_reader(settings: Mapping[str, Any], info: VideoInfo) -> TagReader | None:
    """What reads the coded tags of the run; None where it has none."""
    tags = settings.get("tags")
    if not tags:
        return None
    return TagReader(tags["family"], info, ids=tags["ids"], fields=settings["detect"]["fields"])


def _untracked(frames: Iterable[Frame], info: VideoInfo) -> Tracked:
    """A recording of which no target is followed: its frames are read to the end, and its tables are empty."""
    n = sum(1 for _ in frames)
    if not n:
        raise VidtrackError("the recording has no frame to track in. Give one that has.")
    from pandas import DataFrame

    from vidtrack.association.tracklets import COLUMNS as TRACKLETS
    from vidtrack.tracking.windows import COLUMNS as WINDOWS

    columns: tuple[str, ...] = (
        "frame",
        "field",
        "time_s",
        "timecode",
        "target",
        "Xf",
        "Yf",
        "sd_x",
        "sd_y",
        "pixels",
        "total_pixels",
    )
    columns += ("mass", "contrast", "background", "box_x", "box_y", "box_w", "box_h", "flag")
    every: list[tuple[str, ...]] = [columns, TRACKLETS, WINDOWS]
    tables = [DataFrame({name: np.zeros(0) for name in names}) for names in every]
    diagnostics = {"samples": n, "measured": 0.0, "targets": {}, "worst": [], "problems": []}
    return Tracked(tables[0], tables[1], tables[2], diagnostics, [], info.time)


def _with_tags(tracked: Tracked, tags: TagReader, settings: Mapping[str, Any]) -> Tracked:
    """The tables with the corners of coded tags behind the targets that were followed."""
    import pandas as pd

    from vidtrack.stages.coded_tags import coded_tags

    order = settings["tags"]
    own = coded_tags(
        tags.seen(), tracked.clock, modules=tags.modules, named=order["named"], where=f"camera {settings['camera']}"
    )
    seen = set(tracked.centroids["frame"]) if settings["targets"] != 0 else None
    corners = own.centroids if seen is None else own.centroids[own.centroids["frame"].isin(seen)]
    tracklets = own.tracklets.assign(tracklet=own.tracklets["tracklet"] + len(tracked.tracklets))
    if seen is not None:
        tracklets = tracklets[tracklets["frame"].isin(seen)]
    diagnostics = tracked.diagnostics | {"tags": own.record["tags"], "false_tags": own.record["false_tags"]}
    diagnostics["targets"] = tracked.diagnostics["targets"] | own.record["targets"]
    if settings["targets"] == 0:
        diagnostics["pixel_locking"] = own.record["pixel_locking"]
        shares = [target["measured"] for target in own.record["targets"].values()]
        diagnostics["measured"] = float(np.mean(shares)) if shares else 0.0
    tables = [
        [table for table in pair if len(table)] or [pair[0]]
        for pair in ((tracked.centroids, corners), (tracked.tracklets, tracklets))
    ]
    both = [pd.concat(pair, ignore_index=True) for pair in tables]
    return tracked._replace(
        centroids=both[0],
        tracklets=both[1],
        diagnostics=diagnostics,
        findings=[*tracked.findings, *own.findings],
    )


def _of_reading(account: ReadAccount, time: Sequence[str]) -> list[Finding]:
    """What was seen while reading, and of the sources of time, as findings; pictures that are lost the verdict judges.

    On a rate that was assumed all times depend.
    """
    found = []
    for line in account.problems:
        assumed = line.endswith("give rate")
        cure = "Set rate of the run to the pictures that the camera took a second." if assumed else ""
        found.append(Finding("doubtful", "rate-assumed" if assumed else "reading", line, cure))
    return [*found, *(Finding("doubtful", "time-source", line, "") for line in time)]


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


def _course(samples: BackgroundSamples, tracked: Tracked, light: DataFrame, bits: int) -> DataFrame:
    """The still background, a row a compared frame and patch: where the patch lay at first, how far it moved, px."""
    from pandas import DataFrame

    seen = tracked.tracklets
    targets = Targets(
        seen["frame"].to_numpy(np.int64),
        seen[["Xf", "Yf"]].to_numpy(float),
        np.sqrt(np.maximum(seen["pixels"].to_numpy(float), 1) / np.pi),
    )
    course = background_course(samples, targets, scale=255 / (2**bits - 1))
    used = tracked.centroids["frame"]
    within = (course.frames >= used.min()) & (course.frames <= used.max())
    frames, n = course.frames[within], len(course.middles)
    each = {
        "frame": np.repeat(frames, n),
        "time_s": np.repeat(light["time_s"].to_numpy()[frames], n),
        "patch": np.tile(np.arange(n), len(frames)),
    }
    each |= dict(zip(("Xf", "Yf"), np.tile(course.middles, (len(frames), 1)).T, strict=True))
    each |= dict(zip(("dx", "dy"), course.shift[within].reshape(-1, 2).T, strict=True))
    each |= dict(zip(("sd_x", "sd_y"), course.sd[within].reshape(-1, 2).T, strict=True))
    return DataFrame(each)


def _begun(samples: BackgroundSamples, bits: int) -> NDArray[np.uint16]:
    """The picture with which the recording begins; one px where no frame of it is good."""
    picture = np.zeros((1, 1)) if samples.reference is None else samples.reference * (255 / (2**bits - 1))
    return np.asarray(np.rint(picture * GREY_LEVEL), np.uint16)


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
