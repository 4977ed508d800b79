"""Job self_calibrate: the cameras and what they saw of a floating body in; refined.json of each and self.json out."""

from __future__ import annotations

import sys

from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet
from vidtrack.stages.self_calibrate import self_calibrate
from vidtrack.workflow.job import Job

FRESH = ("standard_errors", "correlations", "uncertainty", "position", "position_sd", "joint", "provenance")
"""Keys of a camera.json that a refined camera has of its own."""
ELSEWHERE = ("findings", "warnings")
"""Keys that are said by camera.json already."""


def run(job: Job) -> None:
    """inputs: cameras, points (a path a camera, in the order of settings.cameras), sights (of settings.runs).

    settings: units, body, sigma, runs, cameras, targets. outputs: record; camera_i for camera i: as it was, where the
    body does not make it better.
    """
    settings = job.settings
    names = settings["cameras"]
    calibrated = {name: read_camera(path) for name, path in zip(names, job.paths("cameras"), strict=True)}
    done = self_calibrate(
        {run: read_parquet(path) for run, path in zip(settings["runs"], job.paths("sights"), strict=True)},
        calibrated,
        settings["targets"],
        points={name: read_parquet(path) for name, path in zip(names, job.paths("points"), strict=False)},
        sigma=settings["sigma"],
        body=settings["body"],
        units=settings["units"],
    )
    for finding in done.findings:
        if finding.level != "note":
            sys.stderr.write(f"warning: {finding.text}. {finding.cure}\n")
    for i, name in enumerate(names):
        before = calibrated[name].record
        dropped = (*ELSEWHERE, *(FRESH if done.used else ("provenance",)))
        kept = {key: value for key, value in before.items() if key not in dropped}
        kept["describes"] = calibrated[name].describes
        record = kept | ({"joint": done.joint} if done.joint else {}) | {"self": {"used": done.used}}
        write_camera(job.outputs[f"camera_{i}"], done.cameras[i], done.uncertainties[i], record, job.provenance)
    write_json(job.outputs["record"], done.record, job.provenance)
