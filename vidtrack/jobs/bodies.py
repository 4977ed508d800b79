"""Job bodies: results/runs/<run>/trajectories.parquet -> bodies.parquet and bodies.json."""

from __future__ import annotations

from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.motion.pose_columns import COLUMNS
from vidtrack.stages.bodies import account, bodies, with_tagged
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories; poses and posed, of a run with coded tags.

    outputs: bodies, record. settings: units, run, bodies.
    """
    units = job.settings["units"]
    table = bodies(
        read_parquet(job.path("trajectories")),
        job.settings["bodies"],
        where=f"config.yaml: runs.{job.settings['run']}.bodies",
    )
    located, findings = account(table)
    found, columns = as_records(findings), dict(COLUMNS)
    if poses := job.paths("poses"):  # of bodies with coded tags
        of_tags = read_json(job.path("posed"))
        table, own = with_tagged(table, read_parquet(poses[0]), of_tags["bodies"])
        located, found = located | own, [*found, *of_tags["findings"]]
        columns["n_cameras"] = ""
    write_parquet(job.outputs["bodies"], table, units=units, provenance=job.provenance, columns=columns)
    record = {"run": job.settings["run"], "units": units, "bodies": located, "findings": found}
    write_json(job.outputs["record"], record, job.provenance)
