"""Job report_one_file: all pages of the report -> results/report_one_file.html."""

from __future__ import annotations

import os
from pathlib import Path

from vidtrack.files.atomic import replacing
from vidtrack.report.one_file import one_file
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: report, pages (in the order in which they are shown). outputs: whole. settings: none."""
    home = os.path.dirname(job.path("report"))
    paths = [job.path("report"), *job.paths("pages")]
    pages = {os.path.relpath(path, home).replace(os.sep, "/"): Path(path).read_text("utf-8") for path in paths}
    with replacing(job.outputs["whole"]) as file:
        file.write(one_file(pages).encode())
