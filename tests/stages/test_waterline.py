from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests.files.clips import make_clip
from tests.shore.rendered_beach import ENDS, shore, video
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet, read_units
from vidtrack.files.timestack_file import read_timestacks
from vidtrack.jobs import waterline as job
from vidtrack.stages.waterline import COLUMNS, waterline
from vidtrack.timing.timebase import time_base
from vidtrack.timing.timecode import Timecode
from vidtrack.workflow.job import Job


@cache
def beach():
    return shore(frames=60)


def follow(transects=None, filmed=None, corrupt=(), **options):
    filmed = filmed or beach()
    frames, info = video(filmed, corrupt)
    return waterline(frames, info, filmed.camera, transects or {"middle": ENDS}, **options)


def test_run_up_in_world_units():
    done = follow()
    table = done.runup
    assert list(table) == list(COLUMNS)
    assert len(table) == 60
    error = table["x"] - beach().edge
    assert np.sqrt((error**2).mean()) < 0.06  # m: about a px
    assert table["z"].to_numpy() == pytest.approx(beach().edge * 0.1, abs=0.02)
    assert table["sigma_z"].to_numpy() == pytest.approx(table["sigma_s"].to_numpy() * 0.1 / np.hypot(1, 0.1))
    stack = done.timestacks["middle"]
    assert stack.grey.shape == (60, len(stack.s))
    assert stack.grey.dtype == np.uint8
    told = done.record["transects"]["middle"]
    assert told["highest_z"] == pytest.approx(beach().edge.max() * 0.1, abs=0.02)
    assert told["mean_z"] == pytest.approx(beach().edge.mean() * 0.1, abs=0.01)


def test_several_transects_are_followed_at_once():
    south = {"from": [0.5, -2, 0.05], "to": [9.0, -2, 0.9]}
    assert set(follow({"middle": ENDS, "south": south}).runup["transect"]) == {"middle", "south"}


def test_what_the_calibration_leaves_open_adds_to_the_uncertainty():
    unsure = Uncertainty(("Cx", "Cy"), np.array([5.0, 0, 0.5]), np.diag([4.0, 4.0]))
    plain, wide = follow().runup["sigma_s"], follow(uncertainty=unsure).runup["sigma_s"]
    # two px along the transect, some 5 cm each
    assert 0.05 < np.sqrt(wide**2 - plain**2).median() < 0.2


def test_times_follow_the_recording_and_its_clock():
    frames, info = video(beach())
    info = type(info)(320, 240, Fraction(15), time=time_base(Fraction(15), Timecode(15 * 36000, Fraction(15))))
    done = waterline(frames, info, beach().camera, {"middle": ENDS}, clock={"offset_s": 0.5, "rate_ppm": 0.0})
    assert done.runup["time_s"].tolist()[:2] == pytest.approx([36000.5, 36000.5 + 1 / 15])
    assert done.runup["timecode"][1] == "10:00:00:01"


def test_a_corrupt_frame_is_a_row_without_an_edge():
    row = follow(corrupt=(7,)).runup.iloc[7]
    assert row["flag"] == "corrupt"
    assert np.isnan(row["s"])


def test_an_unseen_transect_is_refused_by_name():
    with pytest.raises(VidtrackError, match=r"transects.west: the camera does not see any of it"):
        follow({"west": {"from": [-50, 0, 0], "to": [-40, 0, 1]}})


def test_a_transect_without_water_is_a_finding():
    found = follow({"dry": {"from": [8.2, 0, 0.82], "to": [11, 0, 1.1]}}).findings
    assert ("bad", "waterline-still") in [(f.level, f.code) for f in found]
    assert "transect dry" in found[0].text
    assert follow().findings == ()


def test_water_that_passes_the_end_of_a_transect_is_a_finding_with_its_share():
    found = follow({"short": {"from": [0.5, 0, 0.05], "to": [5.0, 0, 0.5]}}).findings
    (end,) = [f for f in found if f.code == "waterline-end"]
    assert end.level == "doubtful"
    beyond = (beach().edge > 5.0).mean()
    assert float(end.text.split()[-5]) == pytest.approx(100 * beyond, abs=3)


def test_four_frames_are_too_few():
    with pytest.raises(VidtrackError, match="4 good frames"):
        follow(filmed=beach()._replace(pictures=beach().pictures[:4]))


def test_the_job_reads_the_video_and_writes_run_up_and_timestacks(tmp_path):
    clip = make_clip(
        tmp_path / "cam1.mkv",
        "ffv1",
        "gray",
        n=60,
        size=(320, 240),
        rate=Fraction(15),
        picture=lambda i: beach().pictures[i],
    )
    write_camera(tmp_path / "camera.json", beach().camera, None, {"model": "tsai", "units": "m"})
    (tmp_path / "profile.csv").write_text("x,y,z\n0,0,0\n5,0,0.5\n12,0,1.2\n")
    settings = {"units": "m", "run": "storm", "camera": "cam1", "start_timecode": "10:00:00:00", "clock": "auto"}
    settings["transects"] = {"middle": {**ENDS, "step": None, "profile": "profile.csv"}}
    inputs = {"video": str(clip), "camera": str(tmp_path / "camera.json"), "profiles": str(tmp_path / "profile.csv")}
    outputs = {"waterline": str(tmp_path / "w.parquet"), "timestack": str(tmp_path / "w.npz")}
    outputs["record"] = str(tmp_path / "w.json")
    job.run(Job(settings, inputs, outputs))
    table = read_parquet(outputs["waterline"])
    assert np.sqrt(((table["x"] - beach().edge) ** 2).mean()) < 0.06
    assert table["time_s"].iloc[0] == 36000
    assert read_units(outputs["waterline"])["sigma_s"] == "m"
    assert read_timestacks(outputs["timestack"])["middle"]["grey"].shape[0] == 60
    record = read_json(outputs["record"])
    assert record["transects"]["middle"]["highest_z"] == pytest.approx(table["z"].max())
    assert record["findings"] == []
