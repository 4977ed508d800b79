"""Job analysis: trajectories, bodies and other instruments' channels -> analysis.json and motions.parquet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vidtrack.analysis.channel_clock import begun_on_run
from vidtrack.files.channel_files import read_channels
from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.findings import as_records
from vidtrack.stages.analysis import COLUMNS, analysis
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """inputs: trajectories; located (locate.json); bodies, channels where there are any; light of each camera where the
    channels' clock is joined by a lamp. outputs: motions, record.

    settings: units, run, cameras, points, shapes, axes, decay, waves, channels.
    """
    order = job.settings
    how = order["channels"] or {}
    done = analysis(
        read_parquet(job.path("trajectories")),
        read_parquet(job.path("bodies")) if job.paths("bodies") else None,
        _channels(job),
        clock={"offset_s": how.get("offset_s"), **(how.get("clock") or {})},
        light=_light(job),
        given=list(how.get("columns") or {}) or None,
        points=order["points"],
        axes=order["axes"],
        about=order["about"],
        decay=order["decay"],
        waves=order["waves"],
        uncertainty=read_json(job.path("located")).get("uncertainty"),
        shapes=order["shapes"],
        units=order["units"],
        where=f"config.yaml: runs.{order['run']}.analysis",
    )
    units = order["units"]
    write_parquet(job.outputs["motions"], done.motions, units=units, provenance=job.provenance, columns=COLUMNS)
    record = {"run": order["run"], **done.record, "findings": as_records(done.findings)}
    write_json(job.outputs["record"], record, job.provenance)


def _channels(job: Job) -> DataFrame | None:
    """The channels by their names, and the column that joins their clock to the video's by its own."""
    how = job.settings["channels"]
    if not how or not job.paths("channels"):
        return None
    clock = how["clock"] or {}
    more = [column for column in (clock.get("lamp"), clock.get("motion")) if column and column not in how["columns"]]
    return read_channels(job.path("channels"), how["columns"] | dict(zip(more, more, strict=True)), **_times(how))


def _times(how: dict[str, Any]) -> dict[str, Any]:
    return {"time": how["time"], "rate": how["rate"]}


def _light(job: Job) -> dict[str, DataFrame]:
    """When the exposures of each camera began, on the run's clock, and how bright its pictures were."""
    if not job.paths("light"):
        return {}
    located = read_json(job.path("located"))
    tables = {c: read_parquet(path) for c, path in zip(job.settings["cameras"], job.paths("light"), strict=True)}
    return {c: own.assign(begun_s=begun_on_run(own["middle_s"], located, c)) for c, own in tables.items()}
