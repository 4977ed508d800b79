"""Job import_points: files of digitised calibration points -> what job calibration_points writes of clips."""

from __future__ import annotations

import numpy as np

from vidtrack.exchange.tracks.digitised import Convention
from vidtrack.exchange.tracks.picture_points import needed_size, read_points
from vidtrack.files.records import write_json, write_png
from vidtrack.files.tables import read_points as read_survey
from vidtrack.files.tables import write_parquet
from vidtrack.findings import as_records
from vidtrack.stages.import_points import Seen, drawn, import_points
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Inputs points, files (a path a clip, in the order of settings["clips"]); outputs as calibration_points has
    them."""
    order, clips = job.settings, job.settings["clips"]
    camera = order["camera"]
    said = Convention.of(order["tracks"])
    where = f"cameras.{camera}.tracks"
    size = needed_size(said, camera)
    survey = read_survey(job.path("points"), order["units"])
    read = {clip: read_points(path, said, where) for clip, path in zip(clips, job.paths("files"), strict=True)}
    table, findings = import_points(
        {clip: Seen(own.tags, own.b, own.sd, own.pixels, own.p) for clip, own in read.items()},
        survey,
        tags={clip: own["tags"] for clip, own in clips.items()},
        sd={clip: own["sd"] for clip, own in clips.items()},
        sigma=order["sigma"],
        camera=camera,
    )
    width, height = size
    shape = {"width": width, "height": height, "sample_aspect": "1", "rotation": 0}
    record = {
        "imported": {clip: own.format for clip, own in read.items()},
        "points": int(table["tag"].nunique()),
        "found": int(table.loc[table["found"], "tag"].nunique()),
        "pictures": dict.fromkeys(clips, shape),
        "background": {"clip": next(iter(clips))},
        "findings": as_records(findings),
    }
    write_parquet(job.outputs["sightings"], table, units=order["units"], provenance=job.provenance)
    write_png(job.outputs["picture"], drawn(table, size))
    write_png(job.outputs["background"], np.zeros((1, 1), np.uint16))
    write_json(job.outputs["record"], record, job.provenance)
