"""Job clocks: recordings' sound and light -> results/runs/<run>/clocks.json."""

from __future__ import annotations

import numpy as np

from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import read_parquet
from vidtrack.stages.clocks import clocks
from vidtrack.timing.run_scale import code_from_record, run_scale
from vidtrack.video.reader import open_video
from vidtrack.video.room_sound import RATE_HZ, RoomSound, room_sound
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: videos, light, readings (in the order of settings.cameras); output record.

    settings: run, cameras, references, sought. Sound is read only of cameras whose clocks it is to give.
    """
    names, sought = job.settings["cameras"], job.settings["sought"]
    light = {name: read_parquet(path) for name, path in zip(names, job.paths("light"), strict=True)}
    codes = {name: code_from_record(read_json(path)) for name, path in zip(names, job.paths("readings"), strict=True)}
    for name, later in run_scale(codes).shift.items():  # clocks are compared on the scale that locate uses
        light[name][["time_s", "middle_s"]] += later
    listening = [name for name in names if name in job.settings["references"] or "sound" in sought.get(name, ())]
    sounds = {}
    if any("sound" in methods for methods in sought.values()):
        for name, path in zip(names, job.paths("videos"), strict=True):
            if name in listening:
                with open_video(path, **job.settings.get("recordings", {}).get(name, {})) as video:
                    start, pace = video.info.start, video.info.pace
                if pace != 1:  # the sound of slow motion is not stretched as its pictures are
                    sounds[name] = RoomSound(
                        0.0, np.zeros(0, np.float32), "not used: the rate of the pictures was given"
                    )
                    continue
                table = light[name]
                sounds[name] = room_sound(path, start, table["stamp_s"].to_numpy(), table["time_s"].to_numpy())
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
