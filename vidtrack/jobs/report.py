"""Job report: the verdict, the calibration's records and the summaries of all runs -> results/report.html."""

from __future__ import annotations

import os
from contextlib import suppress

from vidtrack.files.results_files import read_results
from vidtrack.report.addresses import FOLDER
from vidtrack.report.index_page import index_page
from vidtrack.report.page_file import write_page
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: results (see workflow/rules/report.smk). settings: title, units, runs. outputs: report.

    Pages of runs that are gone, or that failed this time, are removed: nothing leads to them any more.
    """
    order, paths = job.settings, job.paths("results")
    page = index_page(
        read_results(paths),
        units=order["units"],
        runs=list(order["runs"]),
        title=order["title"],
        provenance=job.provenance,
    )
    write_page(job.outputs["report"], page)
    _remove_others(os.path.join(os.path.dirname(job.outputs["report"]), FOLDER), paths)


def _remove_others(folder: str, paths: list[str]) -> None:
    """Remove the pages in `folder` that are none of these inputs nor beside one of them."""
    kept = {os.path.splitext(os.path.basename(path))[0] for path in paths if os.path.dirname(path).endswith(FOLDER)}
    with suppress(FileNotFoundError):
        for name in os.listdir(folder):
            stem, kind = os.path.splitext(name)
            if kind in (".html", ".json") and stem not in kept:
                os.unlink(os.path.join(folder, name))
