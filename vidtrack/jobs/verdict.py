"""Job verdict: every record of the experiment -> results/verdict.json."""

from __future__ import annotations

from vidtrack.files.records import write_json
from vidtrack.files.results_files import read_results
from vidtrack.stages.verdict import verdict
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: results (all JSON records, points.parquet, trajectories.parquet). settings: runs[, awaited]. outputs:
    verdict.
    """
    record = verdict(read_results(job.paths("results")), job.settings["runs"], job.settings.get("awaited", ()))
    write_json(job.outputs["verdict"], record, job.provenance)
