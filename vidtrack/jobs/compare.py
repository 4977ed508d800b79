"""Job compare: trajectories, reference.csv and truth.csv -> comparison.json and comparison.parquet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.formats import read_measured
from vidtrack.exchange.points.measured import as_reference, as_truth
from vidtrack.files.csv_columns import reference_record
from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_csv, read_parquet, read_truth, write_parquet
from vidtrack.stages.compare import COLUMNS, compare
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """inputs: trajectories; field (backprojection.json), reference, truth where there are any.

    settings: run, units, time, value, axis, target[, offset_s, field_diagonal,
    longest_lag, named]. outputs: comparison, series.
    """
    order = job.settings
    where = f"runs.{order['run']}"
    reference = None
    if job.paths("reference"):
        reference = _reference(job, where)
    diagonal = order.get("field_diagonal")
    if diagonal is None and job.paths("field"):
        diagonal = read_json(job.path("field")).get("diagonal_field")
    done = compare(
        read_parquet(job.path("trajectories")),
        reference,
        _truth(job, where) if job.paths("truth") else None,
        value=order.get("value"),
        time=order.get("time") or "time_s",
        axis=order.get("axis") or "x",
        target=order.get("target"),
        field_diagonal=diagonal,
        longest_lag=order.get("longest_lag"),
        offset_s=order.get("offset_s"),
        units=order["units"],
        named=order.get("named", True),
        where=where,
    )
    write_json(job.outputs["comparison"], done.record, job.provenance)
    write_parquet(job.outputs["series"], done.series, units=order["units"], provenance=job.provenance, columns=COLUMNS)


def _reference(job: Job, where: str) -> DataFrame:
    """The record of the contact sensor, or of a point that another instrument measured."""
    order, path = job.settings, job.path("reference")
    if path.endswith(".csv"):
        return read_csv(path, reference_record(order["time"], order["value"]), others="ignore", units=order["units"])
    table = as_reference(read_measured(path), order["units"], order.get("offset_s"), f"{where}.reference")
    if order["value"] not in table:
        known = ", ".join(str(name) for name in list(table)[1:7])
        raise VidtrackError(
            f"config.yaml: {where}.reference.value: {path} has the columns "
            f"{known}{' ...' * (table.shape[1] > 7)}. Name one."
        )
    return table


def _truth(job: Job, where: str) -> DataFrame:
    """Where the targets truly were."""
    order, path = job.settings, job.path("truth")
    if path.endswith(".csv"):
        return read_truth(path, order["units"])
    offset = (order.get("truth") or {}).get("offset_s")
    return as_truth(read_measured(path), order["units"], offset, f"{where}.truth")
