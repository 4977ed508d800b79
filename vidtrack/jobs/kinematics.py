"""Job kinematics: results/runs/<run>/trajectories.parquet -> kinematics.parquet and kinematics.json."""

from __future__ import annotations

from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.stages.kinematics import COLUMNS, USED, jump_findings, kinematics
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories. outputs: kinematics, record. settings: units."""
    trajectories, units = read_parquet(job.path("trajectories"), USED), job.settings["units"]
    table, smoothing = kinematics(trajectories)
    write_parquet(job.outputs["kinematics"], table, units=units, provenance=job.provenance, columns=COLUMNS)
    record = {"units": units, "smoothing": smoothing, "findings": as_records(jump_findings(trajectories, units))}
    write_json(job.outputs["record"], record, job.provenance)
