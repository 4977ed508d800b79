"""Job waterline: a video and its calibrated camera -> waterline.parquet, .json and the timestacks, waterline.npz."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from vidtrack.files.camera_json import read_camera
from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import PROFILE
from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import write_json
from vidtrack.files.tables import write_parquet
from vidtrack.files.timestack_file import write_timestacks
from vidtrack.findings import as_records
from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.location.cameras.run_pictures import Pictures, camera_shown, record_of, windows
from vidtrack.progress import Progress
from vidtrack.stages.waterline import COLUMNS, waterline
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import find_time
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: video, camera, profiles (in the order of the transects that name one). outputs: waterline, timestack,
    record. labelling of the camera's calibration, where there is one.

    settings: run, camera, units, transects, start_timecode, clock, crop.
    """
    order = job.settings
    where = f"config.yaml: runs.{order['run']}.waterline"
    calibrated = read_camera(job.path("camera"))
    known = read_labelling(job.path("labelling")).get("pictures") if job.paths("labelling") else None
    clip = picture_from_record(next(iter(known.values()))) if known else Picture(*calibrated.camera.image_size)
    with open_video(job.path("video"), threads=job.threads, **order.get("recording", {})) as video:
        found = find_time(job.path("video"), video.info, start_timecode=order.get("start_timecode"))
        info = replace(video.info, time=found.base)
        own = Picture(info.width, info.height, info.sample_aspect, info.rotation)
        name = order["camera"]
        shown, assumed = windows({name: Pictures(clip, own, order.get("crop"))}, f"runs.{order['run']}")
        camera, uncertainty = camera_shown(calibrated.camera, calibrated.uncertainty, shown.get(name))
        with Progress(f"waterline {order['run']}/{order['camera']}", info.n_expected, "frames") as progress:
            done = waterline(
                progress.over(video.frames(apart=True)),
                info,
                camera,
                order["transects"],
                uncertainty=uncertainty,
                profiles=_profiles(job),
                clock=order["clock"] if isinstance(order.get("clock"), dict) else None,
                still=order.get("still"),
                where=where,
            )
    units = order["units"]
    write_parquet(job.outputs["waterline"], done.runup, units=units, provenance=job.provenance, columns=COLUMNS)
    record = {"run": order["run"], "camera": order["camera"], "units": units, **done.record}
    record |= {"pictures": record_of(shown), "findings": as_records([*assumed, *done.findings])}
    write_json(job.outputs["record"], record, job.provenance)
    write_timestacks(job.outputs["timestack"], {name: stack._asdict() for name, stack in done.timestacks.items()})


def _profiles(job: Job) -> dict[str, Any]:
    names = [name for name, transect in job.settings["transects"].items() if transect.get("profile")]
    tables = [
        checked_csv(path, PROFILE, others="ignore", units=job.settings["units"]) for path in job.paths("profiles")
    ]
    return {n: np.stack([t[a] for a in "xyz"], -1) for n, t in zip(names, tables, strict=True)}
