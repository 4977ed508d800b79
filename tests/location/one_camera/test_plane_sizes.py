"""The camera of mode plane shows by the width of its targets whether its lens is as it was calibrated."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.cameras.ball_sizes import COMPARING, px_per_unit
from vidtrack.location.one_camera.plane_sizes import plane_sizes
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]  # looks at the plane z = 0 from 45 degrees
SHEET = np.stack([*np.meshgrid(np.linspace(-20, 20, 6), np.linspace(-14, 14, 4)), np.zeros((4, 6))], -1).reshape(-1, 3)
T = np.linspace(0, 6, 30)
PATH = np.stack([15 * np.sin(T), 9 * np.cos(1.3 * T), 0 * T], -1)


def wide(p, rng, factor=1.0, noise=0.002):
    b = project(CAMERA, p)
    width = 2 * factor * px_per_unit(CAMERA, p) * np.exp(rng.normal(0, noise, len(p)))
    return {"Xf": b[:, 0], "Yf": b[:, 1], "width": width}


def sizes(factor=1.0, balls=SHEET, path=PATH, seed=1, **more):
    rng = np.random.default_rng(seed)
    return plane_sizes("cam1", {"t1": wide(path, rng, factor)}, wide(balls, rng) | more)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("zoom", [0.985, 1.0, 1.02])
def test_a_zoom_is_found_and_none_where_there_is_none(zoom, seed):
    (own,) = sizes(zoom, seed=seed).values()
    t1 = own["targets"]["t1"]
    assert own["scatter"] == pytest.approx(0.002, rel=0.6)
    assert t1["sd"] < 0.002
    assert abs(t1["larger"] - np.log(zoom)) < 4 * t1["sd"]


def test_far_from_the_balls_nothing_is_known():
    assert sizes(path=PATH + np.array([60, 40, 0])) == {}


@pytest.mark.parametrize("balls", [SHEET[: COMPARING.balls - 1], SHEET[SHEET[:, 1] == -14], SHEET[:6].repeat(2, 0)])
def test_few_balls_and_balls_on_a_line_say_nothing(balls):
    assert sizes(balls=balls) == {}


def test_balls_that_were_left_out_do_not_count():
    used = np.ones(len(SHEET), bool)
    used[7:] = False
    assert sizes(used=used) == {}


def test_without_widths_nothing_is_compared():
    balls = {key: own for key, own in wide(SHEET, np.random.default_rng(1)).items() if key != "width"}
    assert plane_sizes("cam1", {"t1": {"Xf": [1.0], "Yf": [2.0], "width": [3.0]}}, balls) == {}
    assert plane_sizes("cam1", None, wide(SHEET, np.random.default_rng(1))) == {}
