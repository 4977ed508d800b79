"""A third camera whose clock is wrong is named by its clock, not by a target that nobody else shows."""

import numpy as np
import pytest

from tests.stages.test_locate import centroids, other, pluck
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate

LATE = 11.4 / 30


def run(late, motion=None):
    rng = np.random.default_rng(8)
    cameras = thesis_rig(3)
    tables = {
        c.name: centroids(c, motion or {"t1": pluck, "t2": other}, rng=rng, late=late if i == 1 else 0.0)
        for i, c in enumerate(cameras)
    }
    return locate(tables, {c.name: (c, None) for c in cameras}, targets=2)


@pytest.mark.parametrize("late", [LATE, -LATE])
def test_the_clock_is_named_with_its_offset(late):
    (finding,) = [f for f in run(late).record["findings"] if f["code"] == "clock-differs"]
    assert finding["text"].startswith("cam2: its clock differs")
    said = float(finding["cure"].rsplit(" ", 1)[1].rstrip("."))
    assert abs(said) == pytest.approx(LATE, abs=0.01)
    named = {"cam2": {"offset_s": said, "rate_ppm": 0.0}}
    rng = np.random.default_rng(8)
    cameras = thesis_rig(3)
    tables = {
        c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng, late=late if i == 1 else 0.0)
        for i, c in enumerate(cameras)
    }
    again = locate(tables, {c.name: (c, None) for c in cameras}, targets=2, clocks=named)
    assert not [f for f in again.record["findings"] if f["code"] in ("clock-differs", "track-unmatched")]


def test_cameras_on_one_clock_have_no_such_finding():
    assert not [f for f in run(0.0).record["findings"] if f["code"] == "clock-differs"]


def test_a_camera_that_is_an_hour_off_has_no_part_and_that_is_said():
    rng = np.random.default_rng(8)
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=rng) for c in cameras}
    tables["cam2"]["time_s"] += 3600.0
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=1)
    (finding,) = [f for f in located.record["findings"] if f["code"] == "camera-apart"]
    assert finding["text"].startswith("cam2: it recorded from")
