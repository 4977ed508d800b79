"""A clock that is off by half a second is named, where what is linear in a delay finds other causes."""

from dataclasses import replace

import numpy as np
import pytest

from tests.stages.test_locate import centroids, other, pluck
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate


def run(count, late, clocks=None, turned=0.0):
    rng = np.random.default_rng(8)
    cameras = thesis_rig(count)
    tables = {
        c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng, late=late if i == 1 else 0.0)
        for i, c in enumerate(cameras)
    }
    if turned:
        own = cameras[1]
        cameras[1] = replace(own, R=rotation_from_vector([turned, turned, 0.0]) @ own.R)
    return locate(tables, {c.name: (c, None) for c in cameras}, targets=["t1", "t2"], clocks=clocks).record["findings"]


@pytest.mark.parametrize(("count", "late"), [(2, 0.7), (2, -0.5), (3, 0.7)])
def test_half_a_second_is_named_and_what_is_said_to_be_done_helps(count, late):
    found = run(count, late)
    (finding,) = [f for f in found if f["code"] == "clock-far-off"]
    assert finding["text"].startswith("cam2: its clock is off against")
    said = float(finding["cure"].split("about ")[1].split(".  ")[0].split(". ")[0])
    assert abs(said) == pytest.approx(abs(late), abs=0.04)
    assert not [f for f in found if "Neither one late clock" in f["cure"]]
    assert not [f for f in run(count, late, {"cam2": {"offset_s": said, "rate_ppm": 0.0}}) if f["level"] == "bad"]


def test_clocks_that_agree_and_a_turned_camera_are_no_late_clock():
    assert not [f for f in run(2, 0.0) if f["code"] == "clock-far-off"]
    assert not [f for f in run(2, 0.0, turned=0.02) if f["code"] == "clock-far-off"]


@pytest.mark.parametrize(("stated", "true"), [(25.0, 30.0), (30.0, 25.0), (60.0, 30.0), (7.5, 30.0)])
def test_a_recording_that_states_another_rate_is_named_with_the_rate_at_which_it_fits(stated, true):
    rng = np.random.default_rng(8)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng) for c in cameras}
    own = tables["cam2"]
    first, rate = own["time_s"].min(), 1 / np.diff(np.unique(own["time_s"]))[0]
    tables["cam2"] = own.assign(time_s=first + (own["time_s"] - first) * true / stated)
    found = locate(tables, {c.name: (c, None) for c in cameras}, targets=["t1", "t2"]).record["findings"]
    (finding,) = [f for f in found if f["code"] == "picture-rate-wrong"]
    assert finding["level"] == "bad"
    assert finding["text"].startswith("cam2: its pictures seem to have come at")
    assert float(finding["text"].split(" come at ")[1].split()[0]) == pytest.approx(rate, rel=0.01)
    assert not [f for f in found if "Neither one late clock" in f["cure"]]


def test_slow_motion_beside_a_camera_without_time_code_is_named_though_its_clock_was_sought_in_vain():
    rng = np.random.default_rng(8)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng) for c in cameras}
    own = tables["cam2"]
    tables["cam2"] = own.assign(time_s=3.0 + 4 * (own["time_s"] - own["time_s"].min()))
    clocks = {"cam1": {"offset_s": 0.0}, "cam2": "motion"}
    found = locate(tables, {c.name: (c, None) for c in cameras}, targets=["t1", "t2"], clocks=clocks).record["findings"]
    (finding,) = [f for f in found if f["code"] == "picture-rate-wrong"]
    assert finding["text"].startswith("cam2: its pictures seem to have come at")


def test_cameras_of_one_rate_have_no_other_one():
    for late, turned in ((0.0, 0.0), (0.0, 0.02), (0.7, 0.0)):
        assert not [f for f in run(2, late, turned=turned) if f["code"] == "picture-rate-wrong"]
