"""Job tag_poses: corners of coded tags in all cameras, and their calibration -> the poses of bodies with tags."""

from __future__ import annotations

from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json, write_json
from vidtrack.files.run_inputs import pictures_of, videos_of
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.geometry.picture_part import Picture
from vidtrack.location.clocks.chosen_readout import chosen_readouts
from vidtrack.motion.pose_columns import COLUMNS
from vidtrack.stages.tag_poses import table_of, tag_poses
from vidtrack.tags.poses import TagOrder
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: centroids, cameras, points, labelling, readings, as settings.cameras; located, trajectories.

    settings: run, units, cameras, tags, bodies, targets, crop, readout_ms. outputs: poses, record.
    """
    names, units, order = list(job.settings["cameras"]), job.settings["units"], job.settings
    located = read_json(job.path("located"))
    tables = {name: read_parquet(path) for name, path in zip(names, job.paths("centroids"), strict=True)}
    for name, later in (located.get("time") or {}).get("shift_s", {}).items():
        tables[name]["time_s"] += later
    calibrated = {name: read_camera(path) for name, path in zip(names, job.paths("cameras"), strict=True)}
    points = {name: read_parquet(path) for name, path in zip(names, job.paths("points"), strict=False)}
    sizes = {name: Picture(*own.camera.image_size) for name, own in calibrated.items()}
    used = {name: 1e3 * seconds for name, seconds in (located.get("readout") or {}).items()}
    tags = order["tags"]
    done = tag_poses(
        tables,
        calibrated,
        TagOrder(tags["size"], tags["sigma"], tags["ids"], order["bodies"], order["targets"]),
        clocks=located["clocks"]["cameras"],
        pictures=pictures_of(names, job.paths("labelling"), job.paths("readings"), sizes, order["crop"] or {}),
        points={name: table for name, table in points.items() if len(table)},
        readouts=chosen_readouts(videos_of(names, job.paths("readings")), used or order["readout_ms"] or {}).readouts,
        trajectories=read_parquet(job.path("trajectories")),
        where=f"runs.{order['run']}",
    )
    columns = COLUMNS | {"n_cameras": ""}
    write_parquet(job.outputs["poses"], table_of(done), units=units, provenance=job.provenance, columns=columns)
    record = {"run": order["run"], "units": units, **done.record, "findings": as_records(done.findings)}
    write_json(job.outputs["record"], record, job.provenance)
