"""Job `bundle`: cameras as calibrated alone and their points in, the cameras refined together out."""

from __future__ import annotations

import sys

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.bundle import refine_together, ties_among
from vidtrack.workflow.job import Job

FRESH = ("standard_errors", "correlations", "uncertainty", "misfit", "joint", "provenance")
"""Keys of the lone calibration that do not hold for the joint one."""


def run(job: Job) -> None:
    """inputs alone, points (a path a camera, in the order of settings.cameras); an output for each camera.

    Where a board ties some of them: inputs board (boards.json) and lenses, a path for each of settings.boarded.
    With an output `survey` also a table of where the points are thought to be.
    """
    names, units = job.settings["cameras"], job.settings["units"]
    alone = [read_camera(path) for path in job.paths("alone")]
    for name, each, path in zip(names, alone, job.paths("alone"), strict=True):
        if each.uncertainty is None:
            raise VidtrackError(f"{path}: does not say which parameters of {name} are free. Run calibrate again.")
    points = [read_parquet(path) for path in job.paths("points")]
    tied = read_json(job.path("board"))["ties"] if job.paths("board") else []
    ties = ties_among(tied, names)
    lenses = zip(job.settings.get("boarded", []), job.paths("lenses"), strict=True)
    boards = {name: read_camera(path).camera for name, path in lenses if any(name in tie["cameras"] for tie in ties)}
    if not ties and job.settings.get("board_only"):  # the board ties no cameras: nothing is asked of a bundle
        for name, each in zip(names, alone, strict=True):
            write_camera(job.outputs[name], each.camera, each.uncertainty, each.record, job.provenance)
        return
    bare = job.settings.get("bare", [])
    done = refine_together(
        [each.camera for each in alone],
        # what they saw of the board is in its ties
        [own.assign(used=False) if name in bare else own for name, own in zip(names, points, strict=True)],
        free=[each.uncertainty.names for each in alone if each.uncertainty],
        sigma=job.settings["sigma"],
        prior=[job.settings["prior"].get(name, {}) for name in job.settings["cameras"]],
        lenses=[each.record.get("lens") for each in alone],
        ties=ties,
        boards=boards,
        alone=[None if name in bare else each.uncertainty for name, each in zip(names, alone, strict=True)],
    )
    for finding in done.records[0]["bundle"]["findings"]:
        sys.stderr.write(f"warning: {finding['text']} {finding['cure']}\n")
    for name, camera, uncertainty, record, each in zip(
        names, done.cameras, done.uncertainties, done.records, alone, strict=True
    ):
        kept = {key: value for key, value in each.record.items() if key not in FRESH}
        kept["describes"] = each.describes
        kept["alone"] = {key: kept.get(key) for key in ("rms_px", "max_px", "sigma_px")}
        write_camera(job.outputs[name], camera, uncertainty, {**kept, **record}, job.provenance)
    if "survey" in job.outputs:
        columns = {f"shift_{axis}": "world" for axis in "xyz"}
        write_parquet(job.outputs["survey"], done.points, units=units, provenance=job.provenance, columns=columns)
