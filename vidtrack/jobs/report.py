"""Job report: everything that the other rules made -> results/report.html."""

from __future__ import annotations

from vidtrack.files.results_files import read_results
from vidtrack.report.experiment_page import experiment_page
from vidtrack.report.page_file import write_page
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: results (see workflow/rules/report.smk). settings: title, units, cameras, runs. outputs: report."""
    order = job.settings
    page = experiment_page(
        read_results(job.paths("results")),
        units=order["units"],
        cameras=list(order["cameras"]),
        runs=list(order["runs"]),
        title=order["title"],
        provenance=job.provenance,
    )
    write_page(job.outputs["report"], page)
