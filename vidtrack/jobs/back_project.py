"""Job `back_project`: cameras and calibration points in, backprojection.parquet and .json out."""

from __future__ import annotations

from vidtrack.files.camera_json import Calibrated, read_camera
from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.back_project import back_project
from vidtrack.stages.bundle import ties_among
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs cameras, points (a path a camera, in one order); outputs table, record.

    Where a board ties some of them: inputs board (boards.json) and lenses, a path for each of settings.boarded.
    """
    calibrated = [read_camera(path) for path in job.paths("cameras")]
    names = job.settings["cameras"]
    ties = ties_among(read_json(job.path("board"))["ties"], names) if job.paths("board") else []
    lenses = zip(job.settings.get("boarded", []), job.paths("lenses"), strict=True)
    boards = {name: read_camera(path).camera for name, path in lenses if any(name in tie["cameras"] for tie in ties)}
    done = back_project(
        [each.camera for each in calibrated],
        [read_parquet(path) for path in job.paths("points")],
        refine=job.settings["refine"],
        free=[
            each.uncertainty.names if name in boards else _freed(each)
            for name, each in zip(names, calibrated, strict=True)
            if each.uncertainty
        ]
        or None,
        prior=[job.settings["prior"].get(name, {}) for name in job.settings["cameras"]],
        sigma=job.settings["sigma"],
        units=job.settings["units"],
        ties=ties,
        boards=boards,
        bare=job.settings.get("bare", []),
    )
    units = {f"{axis}_held_out": "world" for axis in "xyz"}
    write_parquet(
        job.outputs["table"], done.table, units=job.settings["units"], provenance=job.provenance, columns=units
    )
    write_json(job.outputs["record"], done.record, job.provenance)


def _freed(camera: Calibrated) -> tuple[str, ...]:
    """The parameters that the points alone decide: not those of a lens that was known beforehand."""
    known = (camera.record.get("lens") or {}).get("names", ())
    return tuple(name for name in (camera.uncertainty.names if camera.uncertainty else ()) if name not in known)
