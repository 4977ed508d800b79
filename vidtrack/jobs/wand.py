"""Job wand: tracks of a waved wand in, every camera's calibration out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.calibration.camera.initial_fit import Nominal
from vidtrack.calibration.wand.measured import wand_of
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import read_json, read_png, write_json, write_png
from vidtrack.files.tables import read_parquet, read_picks, write_parquet
from vidtrack.findings import as_records
from vidtrack.location.clocks.chosen_readout import chosen_readouts
from vidtrack.stages.wand import calibrate_by_wand, on_stated_clocks
from vidtrack.timing.run_scale import code_from_record
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pandas import DataFrame

    from vidtrack.geometry.camera import Camera
    from vidtrack.timing.readout import Readout


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
    tracks, late = _tracks(job, names, "tracks", readings, chosen.readouts, f"calibration.{settings['clip']}")
    drop = None
    if falling := settings["drop_cameras"]:
        dropped = {name: read_json(path) for name, path in zip(falling, job.paths("drop_readings"), strict=True)}
        drop, _ = _tracks(job, falling, "drop", dropped, chosen.readouts, "calibration.wand.axes.drop")
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


def _tracks(
    job: Job, names: list[str], key: str, readings: dict[str, Any], readouts: Mapping[str, Readout], where: str
) -> tuple[dict[str, DataFrame], list[str]]:
    codes = {name: code_from_record(reading) for name, reading in readings.items()}
    tables = {name: read_parquet(path) for name, path in zip(names, job.paths(key), strict=True)}
    clocks = {name: job.settings["cameras"][name]["clock"] for name in names}
    return on_stated_clocks(tables, codes, clocks, readouts, where)


def _nominal(name: str, own: dict[str, Any], video: dict[str, Any]) -> Camera:
    """What the config says of a camera's sensor."""
    return Nominal.of((int(video["width"]), int(video["height"])), own["Cx"], own["Cy"], own["sensor"]).unplaced(name)


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
