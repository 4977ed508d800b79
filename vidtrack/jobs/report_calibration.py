"""Job report_calibration: everything of the calibration -> results/report/calibration.html."""

from __future__ import annotations

from vidtrack.files.results_files import read_results
from vidtrack.report.calibration_page import calibration_page
from vidtrack.report.page_file import write_page
from vidtrack.stages.verdict import verdict
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: results (of the calibration). settings: title, units, cameras. outputs: page.

    The calibration is judged here as in verdict.json.
    """
    results = read_results(job.paths("results"))
    results.verdict = verdict(results, {})
    order = job.settings
    page = calibration_page(
        results,
        units=order["units"],
        cameras=list(order["cameras"]),
        title=order["title"],
        provenance=job.provenance,
    )
    write_page(job.outputs["page"], page)
