"""Job boards: the corners that all cameras saw in; each camera with its lens, and its sightings, out."""

from __future__ import annotations

import sys

from vidtrack.calibration.boards.board import Board
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.boards import boards
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Inputs corners and records (a path a camera, in the order of settings.cameras), and survey: the sightings of
    settings.placing, cameras among which others are placed by the board.

    Outputs record, and for each camera <camera>_lens and <camera>_sightings.
    """
    names, units, order = job.settings["cameras"], job.settings["units"], job.settings["board"]
    records = [read_json(path) for path in job.paths("records")]
    done = boards(
        {name: read_parquet(path) for name, path in zip(names, job.paths("corners"), strict=True)},
        {name: tuple(record["image_size"]) for name, record in zip(names, records, strict=True)},
        Board(**{**order, "marker": order["marker"] or 0.0}),
        world=job.settings["world"],
        units=units,
        surveyed=job.settings["surveyed"],
        survey={
            name: read_parquet(path) for name, path in zip(job.settings["placing"], job.paths("survey"), strict=True)
        },
    )
    for finding in done.findings:
        sys.stderr.write(f"warning: {finding.text} {finding.cure}\n")
    for name in names:
        write_parquet(job.outputs[f"{name}_sightings"], done.sightings[name], units=units, provenance=job.provenance)
        if name not in done.cameras:
            write_json(job.outputs[f"{name}_lens"], done.records[name], job.provenance)
            continue
        write_camera(
            job.outputs[f"{name}_lens"],
            done.cameras[name],
            done.uncertainties[name],
            done.records[name],
            job.provenance,
        )
    write_json(job.outputs["record"], done.record, job.provenance)
