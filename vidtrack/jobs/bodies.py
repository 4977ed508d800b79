"""Job bodies: results/runs/<run>/trajectories.parquet -> bodies.parquet and bodies.json."""

from __future__ import annotations

from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.stages.bodies import COLUMNS, account, bodies
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories. outputs: bodies, record. settings: units, run, bodies."""
    units = job.settings["units"]
    table = bodies(
        read_parquet(job.path("trajectories")),
        job.settings["bodies"],
        where=f"config.yaml: runs.{job.settings['run']}.bodies",
    )
    located, findings = account(table)
    write_parquet(job.outputs["bodies"], table, units=units, provenance=job.provenance, columns=COLUMNS)
    record = {"run": job.settings["run"], "units": units, "bodies": located, "findings": as_records(findings)}
    write_json(job.outputs["record"], record, job.provenance)
