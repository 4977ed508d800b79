"""The job opens clips, and holds time codes in their settings to the clock that each clip carries."""

import numpy as np
import pandas as pd

from tests.discs import picture
from tests.files.clips import NTSC, make_clip
from vidtrack.geometry.camera import project
from vidtrack.jobs.calibration_points import run
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.simulate.rig import points_on_wires, thesis_rig
from vidtrack.timing.timecode import parse
from vidtrack.workflow.job import Job

TEN = parse("10:00:00;00", NTSC)


def test_a_start_is_held_to_the_code_on_the_clip_s_sound_track(tmp_path):
    tags, places = points_on_wires(rows=1, wires=3, balls=4, spacing=(24, 10, 8))
    at = project(thesis_rig()[0], places)
    balls = picture((480, 512), [(*place, 4.0) for place in at], noise=1.0, rng=np.random.default_rng(0))
    nothing = np.full_like(balls, 30)
    sound = ltc_signal(np.arange(3 * 48_000) / 48_000, TEN, start=0.0, level=0.35)
    clip = make_clip(
        tmp_path / "cam1.mkv",
        "ffv1",
        "gray",
        n=60,
        size=(512, 480),
        sound=sound,
        picture=lambda i: balls if 20 <= i <= 29 else nothing,
    )
    pd.DataFrame(places, columns=list("xyz")).assign(tag=tags).to_csv(tmp_path / "points.csv", index=False)
    picks = pd.DataFrame({"camera": "cam1", "tag": tags, "Xf": at[:, 0], "Yf": at[:, 1]})
    picks.to_csv(tmp_path / "picks.csv", index=False)
    detect = {"start": "10:00:00;20", "end": "10:00:00;29"}
    outputs = {name: str(tmp_path / name) for name in ("sightings", "picture", "background", "record")}
    run(
        Job(
            {"camera": "cam1", "picks_clips": ["row1"], "clips": {"row1": {"tags": tags, "detect": detect}}},
            {"points": str(tmp_path / "points.csv"), "videos": [str(clip)], "picks": [str(tmp_path / "picks.csv")]},
            outputs,
        )
    )
    table = pd.read_parquet(outputs["sightings"])
    assert (table["frames"] == 10).all()
    assert np.abs(table[["Xf", "Yf"]].to_numpy() - at).max() < 0.05
