"""Each limit of a wand's judgement: what crosses it, and what does not."""

import numpy as np
import pytest

from tests.calibration.wand.waved import refined, waved
from vidtrack.calibration.wand.axes import Fall, Motion
from vidtrack.calibration.wand.judged import LIMITS, Axes, judge


@pytest.fixture(scope="module")
def rig():
    scene = waved(81, n=200)
    return scene, refined(scene)


def _codes(rig, axes, unsure=(), units="in"):
    scene, done = rig
    found = judge(done, done.cameras, done.found, done.points, scene.wand, ["a", "b"], axes, units, unsure)
    return {(f.level, f.code) for f in found.findings} | {
        (f.level, f.code) for own in found.by_camera.values() for f in own
    }


def test_a_good_wand_has_no_finding(rig):
    assert _codes(rig, Axes("up", explicit=True)) == set()


def _scale(scale, sd=1e-4):
    return Axes("points", explicit=True, motion=Motion(np.eye(3), np.zeros(3), scale, sd, 0.0))


def test_the_scale_of_surveyed_points_may_differ_by_what_is_known_of_it(rig):
    assert _codes(rig, _scale(1 + 0.9 * LIMITS.scale_share)) == set()
    assert _codes(rig, _scale(1.01)) == {("bad", "wand-length-wrong")}
    assert _codes(rig, _scale(1.01, sd=0.005)) == set()


def test_gravity_is_compared_in_the_units_of_the_experiment(rig):
    for units, metre in (("in", 0.0254), ("m", 1.0), ("mm", 0.001)):
        good = Fall(np.array([0, 0, -9.81 / metre]), 0.002 / metre, 20)
        assert _codes(rig, Axes("drop", explicit=True, fall=good), units=units) == set()
        wrong = good._replace(acceleration=good.acceleration * 1.05)
        assert _codes(rig, Axes("drop", explicit=True, fall=wrong), units=units) == {("bad", "wand-length-wrong")}


def test_a_surveyed_point_that_is_elsewhere_is_named(rig):
    axes = Axes("points", explicit=True, tags=("p", "q"), off=np.array([1.0, LIMITS.point + 1]))
    assert _codes(rig, axes) == {("doubtful", "wand-point-off")}


def test_a_clock_that_could_be_another_is_doubtful(rig):
    assert _codes(rig, Axes("up", explicit=True), unsure=["b"]) == {("doubtful", "wand-clock-unsure")}


def test_axes_are_recorded_with_where_they_came_from():
    record = _scale(1.01).as_record()
    assert record["from"] == "points"
    assert record["scale"] == 1.01
    fall = Axes("drop", explicit=True, fall=Fall(np.array([0, 0, -386.0]), 1.0, 20)).as_record()
    assert fall["gravity"]["value"] == 386.0
