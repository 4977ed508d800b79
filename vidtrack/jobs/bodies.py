"""Job bodies: results/runs/<run>/trajectories.parquet -> bodies.parquet."""

from __future__ import annotations

from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.bodies import COLUMNS, bodies
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories. outputs: bodies. settings: units, run, bodies."""
    table = bodies(
        read_parquet(job.path("trajectories")),
        job.settings["bodies"],
        where=f"config.yaml: runs.{job.settings['run']}.bodies",
    )
    write_parquet(job.outputs["bodies"], table, units=job.settings["units"], provenance=job.provenance, columns=COLUMNS)
