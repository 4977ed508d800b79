"""Job wand: tracks of a waved wand in, every camera's calibration out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.calibration.wand.measured import wand_of
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import read_json, read_png, write_json, write_png
from vidtrack.files.tables import read_parquet, read_picks, write_parquet
from vidtrack.findings import as_records
from vidtrack.geometry.camera import Camera
from vidtrack.location.chosen_readout import chosen_readouts
from vidtrack.stages.wand import calibrate_by_wand
from vidtrack.timing.readout import Readout, table_at_frame_time
from vidtrack.timing.run_scale import code_from_record, run_scale
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame

NOT_KNOWN = ("motion", "auto", "sound", "flash")
"""Clocks that the wand's own motion must give."""


def run(job: Job) -> None:
    """inputs: tracks, readings, backgrounds (a path a camera, in the order of settings.cameras); drop, drop_readings
    (of settings.drop_cameras); sightings (of settings.surveyed); picks.

    settings: units, cameras {name: Cx, Cy, sensor, fix, prior, clock}, model, lengths, sigma, axes, clip, surveyed,
    drop_cameras, bare (cameras without clips of points)[, readout_ms]. outputs: record, table; for camera i camera_i,
    points_i and, where it is bare, labelling_i, sightings_i, background_i, picture_i.
    """
    settings = job.settings
    names = list(settings["cameras"])
    readings = {n: read_json(path) for n, path in zip(names, job.paths("readings"), strict=True)}
    chosen = chosen_readouts(
        {n: own["video"] for n, own in readings.items()}, settings.get("readout_ms") or {}, by_motion=False
    )
    late, tracks = _timed(job, names, "tracks", readings, f"calibration.{settings['clip']}")
    tracks = _by_frame(tracks, chosen.readouts)
    drop = None
    if settings["drop_cameras"]:
        dropped = {
            n: read_json(path) for n, path in zip(settings["drop_cameras"], job.paths("drop_readings"), strict=True)
        }
        _, fall = _timed(job, settings["drop_cameras"], "drop", dropped, "calibration.wand.axes.drop")
        drop = _by_frame(fall, chosen.readouts)
    points = {n: read_parquet(path) for n, path in zip(settings["surveyed"], job.paths("sightings"), strict=True)}
    own = settings["cameras"]
    done = calibrate_by_wand(
        tracks,
        {name: _nominal(name, own[name], readings[name]["video"]) for name in names},
        wand_of(settings["lengths"], settings["sigma"]),
        units=settings["units"],
        late=late,
        model=settings["model"],
        priors={name: {key: tuple(value) for key, value in own[name]["prior"].items()} for name in names},
        fixed={name: own[name]["fix"] for name in names},
        points={name: table[table["found"]] for name, table in points.items()} or None,
        picks=_picks(job, names),
        axes=settings["axes"],
        drop=drop,
    )
    for i, name in enumerate(names):
        write_camera(
            job.outputs[f"camera_{i}"], done.cameras[i], done.uncertainties[i], done.records[i], job.provenance
        )
        write_parquet(job.outputs[f"points_{i}"], done.points[i], units=settings["units"], provenance=job.provenance)
        if name in settings["bare"]:
            _write_bare(job, i, name, readings[name])
    done.record["findings"] = [*done.record["findings"], *as_records(chosen.findings)]
    columns = {"time_s": "s", "end": ""}
    write_parquet(job.outputs["table"], done.wand, units=settings["units"], provenance=job.provenance, columns=columns)
    write_json(job.outputs["record"], done.record, job.provenance)


def _by_frame(tracks: dict[str, DataFrame], readouts: Mapping[str, Readout]) -> dict[str, DataFrame]:
    """The tracks at the times of their frames, where a camera's rows are seen one after the other."""
    out = {}
    for name, table in tracks.items():
        by = "tracklet" if "tracklet" in table else "target"
        out[name] = table.assign(**table_at_frame_time(dict(table), by, readouts[name]))
    return out


def _timed(
    job: Job, names: list[str], key: str, readings: dict[str, Any], where: str
) -> tuple[list[str], dict[str, DataFrame]]:
    """The cameras whose clocks are unknown, and the tracks of all on one scale of time."""
    codes = {name: code_from_record(reading) for name, reading in readings.items()}
    shift = run_scale(codes, where).shift
    tables = {name: read_parquet(path) for name, path in zip(names, job.paths(key), strict=True)}
    unset = all(code is None for code in codes.values())
    late = []
    for name in names:
        clock = job.settings["cameras"][name]["clock"]
        t = tables[name]["time_s"] + shift.get(name, 0.0)
        if isinstance(clock, dict):
            t = t + clock["offset_s"] + clock["rate_ppm"] * 1e-6 * (t - t.min())
        elif clock in NOT_KNOWN or unset:
            late.append(name)
        tables[name] = tables[name].assign(time_s=t)
    return late, tables


def _nominal(name: str, own: dict[str, Any], video: dict[str, Any]) -> Camera:
    """What the config says of a camera's sensor; its place and lens are to be found."""
    width, height = int(video["width"]), int(video["height"])
    sensor = own["sensor"]
    dx, dy = (sensor[0] / width, sensor[1] / height) if sensor else (1.0, 1.0)
    Cx = (width - 1) / 2 if own["Cx"] is None else own["Cx"]
    Cy = (height - 1) / 2 if own["Cy"] is None else own["Cy"]
    return Camera(Cx, Cy, dx, dy, 1.0, 1.5 * width * dx, 0.0, np.eye(3), np.zeros(3), (width, height), name=name)


def _picks(job: Job, names: list[str]) -> DataFrame | None:
    from pandas import concat

    parts = [read_picks(path, name).assign(camera=name) for path in job.paths("picks") for name in names]
    return concat(parts, ignore_index=True) if parts else None


def _write_bare(job: Job, i: int, name: str, reading: dict[str, Any]) -> None:
    """What other cameras have from their clips of points: the picture with which runs are compared."""
    from pandas import DataFrame

    video, clip = reading["video"], job.settings["clip"]
    picture = {key: video[key] for key in ("width", "height", "sample_aspect", "rotation") if key in video}
    record = {"camera": name, "pictures": {clip: picture}, "background": {"clip": clip}, "findings": []}
    write_json(job.outputs[f"labelling_{i}"], record, job.provenance)
    columns: dict[str, Any] = {"clip": [], "tag": [], "Xf": [], "Yf": [], "pixels": [], "found": []}
    table = DataFrame(columns).astype({"clip": str, "tag": str, "found": bool})
    table = table.astype(dict.fromkeys(("Xf", "Yf", "pixels"), float))
    write_parquet(job.outputs[f"sightings_{i}"], table, units=job.settings["units"], provenance=job.provenance)
    write_png(job.outputs[f"background_{i}"], np.asarray(read_png(job.paths("backgrounds")[i]), np.uint16))
