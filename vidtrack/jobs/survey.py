"""Job survey: the sightings of all cameras in; survey.json, what they together say of the surveyed points, out."""

from __future__ import annotations

import sys

from vidtrack.files.records import read_png, write_json
from vidtrack.files.tables import read_parquet
from vidtrack.stages.survey import judge_survey
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs sightings, pictures (a path a camera, in the order of settings.cameras); output record."""
    names = job.settings["cameras"]
    shapes = [read_png(path).shape for path in job.paths("pictures")]
    judged = judge_survey(
        dict(zip(names, (read_parquet(path) for path in job.paths("sightings")), strict=True)),
        {name: (shape[1], shape[0]) for name, shape in zip(names, shapes, strict=True)},
        sigma=job.settings["sigma"],
        units=job.settings["units"],
        reject=job.settings["reject"],
        through=job.settings.get("through"),
    )
    for finding in judged.findings:
        sys.stderr.write(f"warning: {finding.text} {finding.cure}\n")
    write_json(job.outputs["record"], judged.record, job.provenance)
