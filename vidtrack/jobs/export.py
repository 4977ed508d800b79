"""Job export: the results of a run -> files of another program under results/runs/<run>/export/."""

from __future__ import annotations

import os

from vidtrack.exchange.formats import written
from vidtrack.exchange.results import read_run
from vidtrack.files.atomic import replacing
from vidtrack.files.records import write_json
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: what the format reads, see `exchange.results`. outputs: record, and each file under its own name.

    settings: format, run, mode, units, axes.
    """
    order = job.settings
    paths = {name: job.paths(name) for name in job.inputs}
    made = written(order["format"], read_run(paths, order["run"], order["units"], order["axes"], order["mode"]))
    places = {os.path.basename(path): path for name, path in job.outputs.items() if name != "record"}
    for name, content in made.files.items():
        with replacing(places[name]) as file:
            file.write(content)
    record = {"run": order["run"], "format": order["format"], "files": sorted(made.files), "notes": made.notes}
    write_json(job.outputs["record"], record, job.provenance)
