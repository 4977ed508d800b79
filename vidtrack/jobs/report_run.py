"""Job report_run: everything of one run, and the calibration that it uses -> its page and its summary."""

from __future__ import annotations

from functools import lru_cache

from vidtrack.files.records import write_json
from vidtrack.files.results_files import is_of_run, read_results
from vidtrack.report.page_file import write_page
from vidtrack.report.run_page import run_page
from vidtrack.report.run_summary import run_summary, run_uncertainty
from vidtrack.results import Results, RunResults
from vidtrack.stages.verdict import CalibrationVerdict, calibration_verdict, verdict
from vidtrack.workflow.fingerprint import AsItIs, as_it_is
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: results (of the run, of the calibration, and the analysis of its repeats). outputs: page, summary.

    settings: run, title, units, cameras, and `asked`: what the config asks of the run, as the verdict takes it. The
    run is judged here as in verdict.json, which holds all other runs as well: their changes leave this page alone.
    """
    order, paths = job.settings, job.paths("results")
    name = str(order["run"])
    calibration, judged = _calibration(tuple(as_it_is(path) for path in paths if not is_of_run(path)))
    results = read_results([path for path in paths if is_of_run(path)], calibration)
    results.verdict = verdict(results, {name: order["asked"]}, of_calibration=judged)
    page = run_page(
        name,
        results,
        units=order["units"],
        cameras=list(order["cameras"]),
        title=order["title"],
        provenance=job.provenance,
    )
    write_page(job.outputs["page"], page)
    summary = run_summary(name, results.runs.get(name, RunResults()))
    summary |= {"uncertainty": run_uncertainty(name, results)}
    write_json(job.outputs["summary"], summary, job.provenance)


@lru_cache(maxsize=2)
def _calibration(files: tuple[AsItIs, ...]) -> tuple[Results, CalibrationVerdict]:
    """The calibration and what is to be said of it: the same for all runs that a process does one after another."""
    results = read_results([path for path, *_ in files])
    return results, calibration_verdict(results)
