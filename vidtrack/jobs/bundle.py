"""Job `bundle`: cameras as calibrated alone and their points in, the cameras refined together out."""

from __future__ import annotations

import sys

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.bundle import refine_together
from vidtrack.workflow.job import Job

FRESH = ("standard_errors", "correlations", "uncertainty", "misfit", "provenance")
"""Keys of the lone calibration that do not hold for the joint one."""


def run(job: Job) -> None:
    """inputs alone, points (a path a camera, in the order of settings.cameras); an output for each camera.

    With an output `survey` also a table of where the points are thought to be.
    """
    names, units = job.settings["cameras"], job.settings["units"]
    alone = [read_camera(path) for path in job.paths("alone")]
    for name, each, path in zip(names, alone, job.paths("alone"), strict=True):
        if each.uncertainty is None:
            raise VidtrackError(f"{path}: does not say which parameters of {name} are free. Run calibrate again.")
    done = refine_together(
        [each.camera for each in alone],
        [read_parquet(path) for path in job.paths("points")],
        free=[each.uncertainty.names for each in alone if each.uncertainty],
        sigma=job.settings["sigma"],
        prior=[job.settings["prior"].get(name, {}) for name in job.settings["cameras"]],
        lenses=[each.record.get("lens") for each in alone],
    )
    for finding in done.records[0]["bundle"]["findings"]:
        sys.stderr.write(f"warning: {finding['text']} {finding['cure']}\n")
    for name, camera, uncertainty, record, each in zip(
        names, done.cameras, done.uncertainties, done.records, alone, strict=True
    ):
        kept = {key: value for key, value in each.record.items() if key not in FRESH}
        kept["alone"] = {key: kept.get(key) for key in ("rms_px", "max_px", "sigma_px")}
        write_camera(job.outputs[name], camera, uncertainty, {**kept, **record}, job.provenance)
    if "survey" in job.outputs:
        columns = {f"shift_{axis}": "world" for axis in "xyz"}
        write_parquet(job.outputs["survey"], done.points, units=units, provenance=job.provenance, columns=columns)
