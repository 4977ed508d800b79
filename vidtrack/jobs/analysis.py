"""Job analysis: trajectories, bodies and other instruments' channels -> analysis.json and motions.parquet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.files.csv_columns import Columns
from vidtrack.files.records import write_json
from vidtrack.files.tables import read_csv, read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.stages.analysis import COLUMNS, analysis
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """inputs: trajectories; bodies, channels where there are any. outputs: motions, record.

    settings: units, run, points, axes, decay, waves, channels.
    """
    order = job.settings
    done = analysis(
        read_parquet(job.path("trajectories")),
        read_parquet(job.path("bodies")) if job.paths("bodies") else None,
        _channels(job),
        points=order["points"],
        axes=order["axes"],
        decay=order["decay"],
        waves=order["waves"],
        units=order["units"],
        where=f"config.yaml: runs.{order['run']}.analysis",
    )
    units = order["units"]
    write_parquet(job.outputs["motions"], done.motions, units=units, provenance=job.provenance, columns=COLUMNS)
    record = {"run": order["run"], **done.record, "findings": as_records(done.findings)}
    write_json(job.outputs["record"], record, job.provenance)


def _channels(job: Job) -> DataFrame | None:
    """The channels by their names, with time_s on the video's clock."""
    how = job.settings["channels"]
    if not how or not job.paths("channels"):
        return None
    wanted = Columns(numbers=(how["time"], *how["columns"].values()), blanks=tuple(how["columns"].values()))
    table = read_csv(job.path("channels"), wanted, others="ignore")
    named = table[list(how["columns"].values())].set_axis(list(how["columns"]), axis=1)
    named.insert(0, "time_s", table[how["time"]] + how["offset_s"])
    return named
