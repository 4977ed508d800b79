"""Job steadiness: a run's backgrounds and those of the calibration in; steadiness.parquet and .json out."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.files.camera_json import read_camera
from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import GREY_LEVEL, read_json, read_png, write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.geometry.camera import units_per_px
from vidtrack.geometry.picture_part import Picture, Window, picture_from_record, window
from vidtrack.stages.steadiness import Background, Calibration, calibration_of, steadiness
from vidtrack.timing.run_scale import code_from_record, run_scale
from vidtrack.workflow.fingerprint import AsItIs, as_it_is
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """inputs, a path a camera in the order of settings["cameras"]: backgrounds (tables), pictures, readings; where the
    run uses a calibration sightings, labelling, calibrated (pictures); in mode space cameras and points too.

    settings: run, units, mode, cameras, crop, clip, scale, follow. outputs: table, record.
    """
    settings = job.settings
    names, where = settings["cameras"], f"runs.{settings['run']}"
    readings = dict(zip(names, map(read_json, job.paths("readings")), strict=True))
    shift = run_scale({name: code_from_record(own) for name, own in readings.items()}, where).shift
    backgrounds = {}
    for i, name in enumerate(names):
        course = read_parquet(job.paths("backgrounds")[i])
        course["time_s"] += shift.get(name, 0.0)
        backgrounds[name] = _background(job, i, course, readings[name], where)
    found = steadiness(backgrounds, where=where, units=settings["units"], follow=settings["follow"])
    write_parquet(job.outputs["table"], found.table, units=settings["units"], provenance=job.provenance)
    write_json(job.outputs["record"], found.record, job.provenance)


def _background(job: Job, i: int, course: DataFrame, reading: dict[str, Any], where: str) -> Background:
    """What is known of the i-th camera."""
    name, video = job.settings["cameras"][i], picture_from_record(reading["video"])
    picture = _grey(job.paths("pictures")[i])
    background = Background(course, picture, reading["background"]["block"], (video.width, video.height))
    if i >= len(job.paths("labelling")):
        return background._replace(per_px=job.settings.get("scale"))
    labelling = read_labelling(job.paths("labelling")[i])
    part = _shown(labelling, video, (job.settings.get("crop") or {}).get(name), name, where)
    files = (job.paths(name)[i] for name in ("calibrated", "sightings", "labelling"))
    calibrated = _calibrated(job.settings.get("clip"), *map(as_it_is, files))
    background = background._replace(window=part, calibration=calibrated)
    if i < len(job.paths("cameras")):
        camera = read_camera(job.paths("cameras")[i]).camera
        shown = camera if part is None else part.camera(camera)
        points = read_parquet(job.paths("points")[i])[["x", "y", "z"]].to_numpy(float)
        return background._replace(camera=shown, per_px=float(np.median(units_per_px(shown, points))))
    return background._replace(per_px=job.settings.get("scale"))


@lru_cache(maxsize=16)
def _calibrated(clip: str | None, picture: AsItIs, sightings: AsItIs, labelling: AsItIs) -> Calibration:
    """What the calibration shows of a camera: the same for all runs that a process does one after another."""
    found = calibration_of(_grey(picture[0]), read_parquet(sightings[0]), read_labelling(labelling[0]), clip)
    for shared in (found.picture, found.balls):
        shared.flags.writeable = False
    return found


def _shown(labelling: dict[str, Any], run: Picture, crop: Any, camera: str, where: str) -> Window | None:
    known = next(iter(labelling["pictures"].values()))
    return window(picture_from_record(known), run, crop, camera=camera, where=where)[0]


def _grey(path: str) -> np.ndarray[Any, Any]:
    return np.asarray(read_png(path), np.float32) / GREY_LEVEL
