"""What became of a job that failed: one small JSON file under `<results>/.failures`, for the verdict and the report.

It is no output of a rule: Snakemake removes what a failed job wrote. It goes when the job is tried again.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

from vidtrack.findings import Finding, as_records
from vidtrack.workflow.provenance import FOLDER as ACCOUNTS
from vidtrack.workflow.provenance import job_parts

FOLDER = ".failures"


def failure_place(account: str) -> str:
    """Where the failure of a job is written, of the place of its account."""
    results, _, job = account.replace(os.sep, "/").rpartition(f"/{ACCOUNTS}/")
    return os.path.join(results, FOLDER, job)


def write_failure(account: str, rule: str, problems: Sequence[str]) -> str:
    """Write why a job failed, as findings of level `failed`; the path of the file.

    The record says the rule and the job's parts: run and camera, or the set of calibration clips and the camera.
    """
    from vidtrack.files.records import write_record  # what it needs is for jobs that fail

    path = failure_place(account)
    findings = [Finding("failed", f"{rule.replace('_', '-')}-failed", problem) for problem in problems]
    record = {"rule": rule, "parts": job_parts(account), "findings": as_records(findings)}
    write_record(path, record)
    return path


def remove_failure(account: str) -> None:
    """Delete the record of a job's earlier failure, and the folders that are then empty."""
    path = failure_place(account)
    if os.path.isfile(path):
        os.unlink(path)
        while os.path.basename(path) != FOLDER:
            path = os.path.dirname(path)
            try:
                os.rmdir(path)
            except OSError:
                break
