"""Job import_tracks: a file of tracks that another program made -> what job track writes of a recording."""

from __future__ import annotations

from typing import Any

import numpy as np

from vidtrack.exchange.tracks.configured import chosen, clock_of
from vidtrack.exchange.tracks.digitised import Convention, Digitised, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.files.records import write_json, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.findings import Finding, as_records
from vidtrack.stages.import_tracks import import_tracks
from vidtrack.timing.run_scale import code_as_record
from vidtrack.timing.timebase import TimeBase
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """input tracks; settings run, camera, names, sd, tracks (what config says of the file), rate, start_timecode."""
    order = job.settings
    where = f"runs.{order['run']}"
    said = Convention.of(order.get("tracks") or {})
    tracks = read_tracks(job.path("tracks"), said, f"{where}.tracks")
    tracks = chosen(tracks, order.get("names"), where)
    b = placed(tracks, said, f"{where}.tracks")
    clock = clock_of(tracks, order.get("rate"), order.get("start_timecode"), where)
    done = import_tracks(
        tracks.names,
        tracks.frame,
        b,
        clock,
        named=tracks.named or bool(order.get("names")),
        sd=order.get("sd"),
        camera=order["camera"],
        where=where,
    )
    size = said.size or tracks.size
    notes = [Finding("note", "tracks-read", note, "") for note in tracks.notes]
    record = {
        "run": order["run"],
        "camera": order["camera"],
        "imported": {
            "format": tracks.format,
            "names": list(tracks.names),
            "notes": list(tracks.notes),
            "together": tracks.together,
        },
        "video": {"width": size[0], "height": size[1], "rate": float(clock.rate), "sample_aspect": "1"}
        if size
        else None,
        "time": {
            "source": clock.source,
            "rate": str(clock.rate),
            "drop": clock.drop,
            "code": code_as_record(clock.first),
            "table": [],
            "problems": [],
        },
        **done.record,
        "findings": as_records([*done.findings, *notes]),
    }
    stamps = tracks.frame / float(clock.rate)
    write_parquet(job.outputs["centroids"], done.centroids, units="px", provenance=job.provenance)
    write_parquet(job.outputs["tracklets"], done.tracklets, units="px", provenance=job.provenance)
    write_json(job.outputs["record"], record, job.provenance)
    write_parquet(job.outputs["light"], _light(tracks, stamps, clock), units="px", provenance=job.provenance)
    write_parquet(job.outputs["background"], _background(), units="px", provenance=job.provenance)
    write_png(job.outputs["picture"], np.zeros((1, 1), np.uint16))


def _light(tracks: Digitised, stamps: Any, clock: TimeBase) -> Any:
    from pandas import DataFrame

    seconds = clock.seconds(stamps)
    columns = {"frame": tracks.frame, "stamp_s": stamps, "time_s": seconds, "middle_s": seconds}
    return DataFrame({**columns, "brightness": np.full(len(stamps), np.nan)})


def _background() -> Any:
    """No patch of any background: there is no picture."""
    from pandas import DataFrame

    whole, real = np.zeros(0, np.int64), np.zeros(0)
    columns = {"frame": whole, "time_s": real, "patch": whole}
    return DataFrame(columns | dict.fromkeys(("Xf", "Yf", "dx", "dy", "sd_x", "sd_y"), real))
