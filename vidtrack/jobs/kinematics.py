"""Job kinematics: results/runs/<run>/trajectories.parquet -> kinematics.parquet and kinematics.json."""

from __future__ import annotations

from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.kinematics import COLUMNS, USED, kinematics
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories. outputs: kinematics, record. settings: units."""
    table, smoothing = kinematics(read_parquet(job.path("trajectories"), USED))
    units = job.settings["units"]
    write_parquet(job.outputs["kinematics"], table, units=units, provenance=job.provenance, columns=COLUMNS)
    write_json(job.outputs["record"], {"units": units, "smoothing": smoothing}, job.provenance)
