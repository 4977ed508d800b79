"""Job compare: trajectories, reference.csv and truth.csv -> comparison.json and comparison.parquet."""

from __future__ import annotations

from vidtrack.files.csv_columns import reference_record
from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_csv, read_parquet, read_truth, write_parquet
from vidtrack.stages.compare import COLUMNS, compare
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: trajectories; field (backprojection.json), reference, truth where there are any.

    settings: run, units, time, value, axis, target[, offset_s, field_diagonal,
    longest_lag]. outputs: comparison, series.
    """
    order = job.settings
    reference = None
    if job.paths("reference"):
        columns = reference_record(order["time"], order["value"])
        reference = read_csv(job.path("reference"), columns, others="ignore")
    diagonal = order.get("field_diagonal")
    if diagonal is None and job.paths("field"):
        diagonal = read_json(job.path("field")).get("diagonal_field")
    done = compare(
        read_parquet(job.path("trajectories")),
        reference,
        read_truth(job.path("truth"), order["units"]) if job.paths("truth") else None,
        value=order.get("value"),
        time=order.get("time") or "time_s",
        axis=order.get("axis") or "x",
        target=order.get("target"),
        field_diagonal=diagonal,
        longest_lag=order.get("longest_lag"),
        offset_s=order.get("offset_s"),
        units=order["units"],
        where=f"runs.{order['run']}",
    )
    write_json(job.outputs["comparison"], done.record, job.provenance)
    write_parquet(job.outputs["series"], done.series, units=order["units"], provenance=job.provenance, columns=COLUMNS)
