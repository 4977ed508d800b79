"""A whole run whose camera turned: named with size and time, and its positions as right as those of one that stood."""

import numpy as np
import pandas as pd
import pytest

from tests.steadiness.scenes import F, Wall, course_of
from vidtrack.geometry.camera import project
from vidtrack.stages.steadiness import THETA, Background, Calibration, at_rest, calibration_of, steadiness
from vidtrack.steadiness.clips import clip_movements
from vidtrack.steadiness.samples import BackgroundSamples, Keeping

STILL = np.zeros(4)
SIZE = (320, 240)


def table_of(course):
    k, n = course.shift.shape[:2]
    columns = {"frame": np.repeat(course.frames, n), "time_s": np.repeat(course.frames / 30, n)}
    columns |= {"patch": np.tile(np.arange(n), k)}
    columns |= dict(zip(("Xf", "Yf"), np.tile(course.middles, (k, 1)).T, strict=True))
    columns |= dict(zip(("dx", "dy"), course.shift.reshape(-1, 2).T, strict=True))
    return pd.DataFrame(columns | dict(zip(("sd_x", "sd_y"), course.sd.reshape(-1, 2).T, strict=True)))


def background(wall, thetas, calibrated=STILL, pixels=700_000, **film):
    film = list(wall.film(thetas, **film))
    samples = BackgroundSamples(Keeping(first=4, stride=1, pixels=pixels))
    list(samples.over(film))
    picture = np.asarray(wall.clean(calibrated), np.float32)
    clips = clip_movements({"row1": picture}, {"row1": np.empty((0, 3))}).as_record()
    known = Calibration(picture, np.empty((0, 3)), clips, {"row1": 10})
    course = table_of(course_of(film, pixels=pixels))
    return Background(course, samples.reference, samples.block, SIZE, wall.camera, None, known, 0.2)


def test_the_balls_of_the_backgrounds_own_clip_are_hidden_and_a_run_in_a_plane_counts_one_clip():
    sightings = pd.DataFrame({"clip": ["row1", "row1", "row2"], "found": [True, False, True]})
    sightings = sightings.assign(Xf=[5.0, 6.0, 7.0], Yf=[1.0, 2.0, 3.0], pixels=[0, 0, 0])
    labelling = {"background": {"clip": "row1"}, "steadiness": {"first": "row1"}}
    found = calibration_of(np.zeros((2, 2)), sightings, labelling)
    assert found.balls.tolist() == [[5.0, 1.0, 0.0]]
    assert found.counts == {"row1": 1, "row2": 1}
    assert found.clips == {"first": "row1"}
    assert calibration_of(np.zeros((2, 2)), sightings, labelling, "row2").counts == {"row2": 1}


def codes(found):
    return [finding["code"] for finding in found.record["findings"]]


def test_a_camera_as_it_was_calibrated_gives_no_finding():
    wall = Wall(np.random.default_rng(31))
    found = steadiness({"cam1": background(wall, [STILL] * 10)}, units="in")
    assert found.record["findings"] == []
    assert found.record["cameras"]["cam1"]["since_calibration"]["px"] < 0.1


def test_a_camera_that_was_knocked_before_and_during_the_run_is_named_twice():
    wall = Wall(np.random.default_rng(32))
    before = np.array([0.0, 3, 0, 0]) / F
    after = wall.law.after(np.array([6.0, 0, 0, 0]) / F, before)
    found = steadiness({"cam1": background(wall, [before] * 8 + [after] * 8)}, where="runs.pluck", units="in")
    assert codes(found) == ["camera-moved-between", "camera-moved-along-run"]
    assert found.record["cameras"]["cam1"]["since_calibration"]["px"] == pytest.approx(3, abs=0.1)
    along = found.record["cameras"]["cam1"]["along_run"]
    assert along["most"]["px"] == pytest.approx(6, abs=0.15)
    assert along["begun_s"] <= 8 / 30 <= along["ended_s"]


def test_followed_positions_are_right_within_their_sigma():
    wall, rng = Wall(np.random.default_rng(33)), np.random.default_rng(34)
    start = np.array([2.0, -3, 1, 0]) / F
    thetas = [wall.law.after(np.array([1.5, 1.0, 0.3, 0]) * min(k, 14) / F, start) for k in range(20)]
    found = steadiness({"cam1": background(wall, thetas)}, follow=True)
    assert {finding["level"] for finding in found.record["findings"]} == {"note"}
    p = rng.uniform(-15, 15, (20, 3))
    rest = project(wall.camera, p)
    seen = np.array([wall.law(b, theta) for b, theta in zip(rest, thetas, strict=True)])
    table = pd.DataFrame({"time_s": np.arange(20) / 30, "Xf": seen[:, 0], "Yf": seen[:, 1], "sd_x": 0.02, "sd_y": 0.02})
    table[["Xf", "Yf"]] += rng.normal(0, 0.02, (20, 2))
    back = at_rest(table, found.table, wall.law)
    error = back[["Xf", "Yf"]].to_numpy() - rest
    assert np.abs(seen - rest).max() > 15
    z = error / back[["sd_x", "sd_y"]].to_numpy()
    assert np.abs(z).max() < 5
    assert np.sqrt((z**2).mean()) < 1.6
    assert np.sqrt((error**2).mean()) < 0.1


def test_positions_of_a_camera_without_texture_stay_and_the_user_is_warned():
    wall = Wall(np.random.default_rng(35), contrast=0.0)
    found = steadiness({"cam1": background(wall, [STILL] * 6)}, follow=True)
    assert codes(found) == ["no-background-texture"]
    assert found.record["findings"][0]["level"] == "doubtful"
    table = pd.DataFrame({"time_s": [0.0], "Xf": [10.0], "Yf": [20.0]})
    assert at_rest(table, found.table, wall.law) is table


def test_a_reduced_picture_is_compared_with_the_calibration_reduced_alike():
    wall = Wall(np.random.default_rng(36), grain=4.0)
    moved = np.array([0.0, 4, 0, 0]) / F
    own = background(wall, [moved] * 6, pixels=20_000)
    assert own.block == 2
    found = steadiness({"cam1": own})
    assert codes(found) == ["camera-moved-between"]
    assert F * found.table[list(THETA)].to_numpy()[0] == pytest.approx([0, 4, 0, 0], abs=0.15)
