"""Track the targets of a run in one camera: video in, centroids and an account of the reading out."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.files.records import GREY_LEVEL, write_json, write_png
from vidtrack.files.tables import read_targets, write_parquet
from vidtrack.findings import as_records
from vidtrack.memory import give_back_memory
from vidtrack.progress import Progress, announce
from vidtrack.stages.track import Tracked, track, untracked
from vidtrack.steadiness.bars import bars_record
from vidtrack.steadiness.samples import BackgroundSamples
from vidtrack.steadiness.series import Targets, background_course
from vidtrack.timing.excerpt import between
from vidtrack.timing.frame import VideoInfo
from vidtrack.timing.lamp import LightMeter
from vidtrack.timing.run_scale import code_as_record
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.tracking.quality.assessment import reading_findings
from vidtrack.tracking.tag_reading.tag_reader import TagReader
from vidtrack.video.reader import open_video
from vidtrack.video.times.makers_rate import rate_finding
from vidtrack.video.times.makers_readout import makers_readout
from vidtrack.video.times.time_source import find_time
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Follow the targets; write centroids, tracklets, the record, and how bright each picture was."""
    from pandas import DataFrame

    settings = job.settings
    camera = settings["camera"]
    with open_video(job.path("video"), threads=job.threads, **settings.get("recording", {})) as video:
        size = (video.info.width, video.info.height)
        boxes = read_targets(job.path("targets"), camera, size) if job.paths("targets") else None
        label = f"track {settings['run']}/{camera}"
        announce(label, phase="reading its time code")  # of a sound track: from beginning to end
        found = find_time(job.path("video"), video.info, start_timecode=settings.get("start_timecode"))
        info = replace(video.info, time=found.base)
        stated = makers_readout(job.path("video"), float(1 / info.rate), info.rotation)
        given = "rate" in settings.get("recording", {})  # then a person has said which rate counts
        taken = [] if given else rate_finding(job.path("video"), float(info.rate), settings["run"])
        meter, samples = LightMeter(info.bits), BackgroundSamples()
        damage = DamagedPictures(info.bits, video.look_again, info.codec)
        tags = _tag_reader(settings, info, damage)
        with Progress(label, info.n_expected, "frames") as progress:
            detect = settings["detect"]
            whole = tags is None and detect.get("start") is None and detect.get("end") is None
            read = video.frames(apart=True, monitor=damage if whole else None, targets=_followed(settings["targets"]))
            frames = meter.over(samples.over(progress.over(read)))
            frames = between(frames, info, detect.get("start"), detect.get("end"), where="detect")
            frames = damage.over(frames)  # to its own end, where it looks again, and before tags are painted over
            if tags is not None:
                frames = tags.over(frames)
            if settings["targets"] == 0 and tags is not None:
                tracked = untracked(frames, info, damage)
            else:
                tracked = track(
                    frames,
                    info,
                    targets=settings["targets"],
                    start_boxes=boxes,
                    damage=damage,
                    **detect,
                )
        if tags is not None:
            tracked = _with_tags(tracked, tags, settings)
        damaged = len(tracked.diagnostics.get("damage_seen", ()))
        account = video.account.after_tracking(measured=tracked.diagnostics["measured"], damaged=damaged)
    del video, damage, frames  # they remember something of each picture
    in_fields = bool((tracked.centroids["field"] != "frame").any())
    light = meter.columns(tracked.clock, in_fields=in_fields)
    course = _course(samples, tracked, light, info.bits)
    record = {
        "run": settings["run"],
        "camera": camera,
        "video": _video_record(info) | _bars(samples, info.bits) | ({"readout": stated.as_record()} if stated else {}),
        "time": {
            "source": info.time.source,
            "rate": str(info.rate),
            "drop": info.time.drop,
            "code": code_as_record(info.time.first),
            "table": [row._asdict() for row in found.table],
            "problems": found.problems,
        },
        "reading": account._asdict(),
        "background": {"block": samples.block, "patches": len(np.unique(course["patch"]))},
        **tracked.diagnostics,
    }
    record["findings"] = as_records([*taken, *tracked.findings, *reading_findings(account, found.problems)])
    record["problems"] = [*found.problems, *tracked.diagnostics["problems"]]
    record["worst"] = [{**worst, "picture": _png_text(worst["picture"])} for worst in record["worst"]]
    tables = [tracked.windows, tracked.tracklets, tracked.centroids]
    del tracked  # each table is given up when it is written
    give_back_memory()
    write_parquet(job.outputs["centroids"], tables.pop(), units="px", provenance=job.provenance)
    write_parquet(job.outputs["tracklets"], tables.pop(), units="px", provenance=job.provenance)
    if "windows" in job.outputs:
        columns = {"left": "px", "top": "px", "width": "px"}
        write_parquet(job.outputs["windows"], tables.pop(), units="px", provenance=job.provenance, columns=columns)
    write_json(job.outputs["record"], record, job.provenance)
    write_parquet(job.outputs["light"], DataFrame(light), units="px", provenance=job.provenance)
    write_parquet(job.outputs["background"], DataFrame(course), units="px", provenance=job.provenance)
    write_png(job.outputs["picture"], _begun(samples, info.bits))


def _followed(targets: int | Sequence[str]) -> int:
    """How many targets are followed, as far as it is known before the recording is read: of all, one."""
    return targets if isinstance(targets, int) else 1 if targets == "all" else len(targets)


def _tag_reader(settings: Mapping[str, Any], info: VideoInfo, damage: DamagedPictures) -> TagReader | None:
    """What reads the coded tags of the run; None where it has none."""
    tags = settings.get("tags")
    if not tags:
        return None
    beside = settings["targets"] != 0
    fields = settings["detect"]["fields"]
    return TagReader(tags["family"], info, ids=tags["ids"], fields=fields, cover=beside, damage=damage)


def _with_tags(tracked: Tracked, tags: TagReader, settings: Mapping[str, Any]) -> Tracked:
    """The tables with the corners of coded tags behind the targets that were followed."""
    from vidtrack.stages.coded_tags import apart_from_tags, behind_targets, coded_tags

    named, where = settings["tags"]["named"], f"camera {settings['camera']}"
    own = coded_tags(tags.seen(), tracked.clock, modules=tags.modules, named=named, where=where)
    others, followed, touching = apart_from_tags(tracked.centroids, tracked.tracklets, tags.patches, where)
    centroids, tracklets, diagnostics = behind_targets(
        own, others, followed, tracked.diagnostics, followed=settings["targets"] != 0
    )
    findings = [*tracked.findings, *touching, *own.findings]
    return tracked._replace(centroids=centroids, tracklets=tracklets, diagnostics=diagnostics, findings=findings)


def _course(
    samples: BackgroundSamples, tracked: Tracked, light: Mapping[str, NDArray[Any]], bits: int
) -> dict[str, NDArray[Any]]:
    """The still background, a row a compared frame and patch."""
    seen, used = tracked.tracklets, tracked.centroids["frame"]
    radius = np.sqrt(np.maximum(seen["pixels"].to_numpy(float), 1) / np.pi)
    targets = Targets(seen["frame"].to_numpy(np.int64), seen[["Xf", "Yf"]].to_numpy(float), radius)
    course = background_course(samples, targets, scale=255 / (2**bits - 1))
    return course.columns(light["time_s"], used.min(), used.max())


def _begun(samples: BackgroundSamples, bits: int) -> NDArray[np.uint16]:
    """The picture with which the recording begins; one px where no frame of it is good."""
    picture = np.zeros((1, 1)) if samples.reference is None else samples.reference * (255 / (2**bits - 1))
    return np.asarray(np.rint(picture * GREY_LEVEL), np.uint16)


def _bars(samples: BackgroundSamples, bits: int) -> dict[str, Any]:
    """The bars about the picture, where there are any."""
    mean = samples.reference
    return bars_record(None if mean is None else mean * (255 / (2**bits - 1)), samples.block)


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
