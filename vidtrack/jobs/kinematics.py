"""Job kinematics: results/runs/<run>/trajectories.parquet -> kinematics.parquet."""

from __future__ import annotations

from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.kinematics import COLUMNS, kinematics
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories. outputs: kinematics. settings: units[, method, noise]."""
    options = {name: job.settings[name] for name in ("method", "noise") if name in job.settings}
    table, told = kinematics(read_parquet(job.path("trajectories")), **options)
    provenance = {**job.provenance, "smoothing": told}
    write_parquet(job.outputs["kinematics"], table, units=job.settings["units"], provenance=provenance, columns=COLUMNS)
