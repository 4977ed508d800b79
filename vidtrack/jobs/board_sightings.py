"""Job board_sightings: the corners of a board stand for surveyed points, where a camera has none."""

from __future__ import annotations

import numpy as np

from vidtrack.files.records import GREY_LEVEL, read_json, read_png, write_json, write_png
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Inputs record, picture and found, as the rules board_corners and boards left them.

    Outputs sightings, picture, background and record, as those of calibration_points.
    """
    record, picture = read_json(job.path("record")), read_png(job.path("picture"))
    table = read_parquet(job.path("found"))
    write_parquet(job.outputs["sightings"], table, units=job.settings["units"], provenance=job.provenance)
    write_png(job.outputs["picture"], picture)
    write_png(job.outputs["background"], (picture.astype(np.uint16) * GREY_LEVEL).astype(np.uint16))
    own = {
        "camera": job.settings["camera"],
        "placed_by": "board",
        "picks": 0,
        "points": len(table),
        "found": len(table),
        "clips": {},
        "pictures": record["pictures"],
        "background": {"clip": next(iter(record["pictures"]))},
        "findings": record["findings"],
    }
    write_json(job.outputs["record"], own, job.provenance)
