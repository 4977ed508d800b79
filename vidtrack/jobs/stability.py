"""Job `stability`: calibrations from before and after a test in, stability.json out."""

from __future__ import annotations

from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet
from vidtrack.stages.stability import stability
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs before, after, before_points, after_points (a path a camera, in one order); output record."""
    before = [read_camera(path) for path in job.paths("before")]
    after = [read_camera(path) for path in job.paths("after")]
    record = stability(
        [each.camera for each in before],
        [each.camera for each in after],
        [read_parquet(path) for path in job.paths("before_points")],
        [read_parquet(path) for path in job.paths("after_points")],
        uncertainties=([each.uncertainty for each in before], [each.uncertainty for each in after]),
        sigma=job.settings["sigma"],
        units=job.settings["units"],
    )
    write_json(job.outputs["record"], record, job.provenance)
