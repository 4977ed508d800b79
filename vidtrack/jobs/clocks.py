"""Job clocks: recordings' sound and light -> results/runs/<run>/clocks.json."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet
from vidtrack.stages.clocks import clocks, heard_cameras
from vidtrack.timing.run_scale import code_from_record, run_scale
from vidtrack.video.reader import open_video
from vidtrack.video.room_sound import RATE_HZ, RoomSound, room_sound
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame


def run(job: Job) -> None:
    """inputs: videos, light, readings (in the order of settings.cameras); output record.

    settings: run, cameras, references, sought. Sound is read only of cameras whose clocks it is to give.
    """
    names, sought = job.settings["cameras"], job.settings["sought"]
    light = {name: read_parquet(path) for name, path in zip(names, job.paths("light"), strict=True)}
    codes = {name: code_from_record(read_json(path)) for name, path in zip(names, job.paths("readings"), strict=True)}
    for name, later in run_scale(codes).shift.items():  # clocks are compared on the scale that locate uses
        light[name][["time_s", "middle_s"]] += later
    videos = dict(zip(names, job.paths("videos"), strict=True))
    sounds = {
        name: _sound(job, name, videos[name], light[name])
        for name in heard_cameras(names, job.settings["references"], sought)
    }
    estimates = clocks(
        light,
        {name: (sound.start, sound.samples) for name, sound in sounds.items() if sound.samples.size},
        rate_hz=RATE_HZ,
        references=job.settings["references"],
        sought=sought,
    )
    record = {
        "run": job.settings["run"],
        "references": job.settings["references"],
        "cameras": estimates,
        "sound": {name: sound.note for name, sound in sounds.items()},
    }
    write_json(job.outputs["record"], record, job.provenance)


def _sound(job: Job, camera: str, path: str, light: DataFrame) -> RoomSound:
    with open_video(path, **job.settings.get("recordings", {}).get(camera, {})) as video:
        start, pace = video.info.start, video.info.pace
    return room_sound(path, start, light["stamp_s"].to_numpy(), light["time_s"].to_numpy(), pace=pace)
