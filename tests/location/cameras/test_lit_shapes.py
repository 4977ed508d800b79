"""Targets that are lit from one side and are not as high as their camera's pixels make a ball."""

import numpy as np

from vidtrack.location.cameras.lit_shapes import lit_shape_findings
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]
BALL = CAMERA.dx / (CAMERA.Sx * CAMERA.dy)


def said(height, sd=0.005, camera=CAMERA):
    return lit_shape_findings({"cam1": {"height": height, "height_sd": sd}}, {"cam1": camera}, "run")


def test_a_ball_is_as_high_as_the_pixels_make_it():
    assert 1.2 < BALL < 1.3  # 8.8 / 512 over 6.6 / 480 mm
    assert said(BALL) == []
    assert said(1.1 * BALL) == []  # towards a corner
    assert said(BALL, camera=CAMERA.with_(dy=CAMERA.dx)) != []


def test_half_a_ball_is_doubtful():
    (half,) = said(0.7 * BALL)
    assert half.level == "doubtful"
    assert half.code == "lit-targets-no-balls"
    assert f"{0.7 * BALL:.2f} times" in half.text


def test_a_height_that_is_hardly_known_says_nothing():
    assert said(0.7 * BALL, sd=0.1) == []
    assert said(float(np.exp(-0.6)) * BALL, sd=0.1) != []


def test_without_a_height_or_a_camera_nothing_is_said():
    assert lit_shape_findings({"cam1": None, "cam2": {"outlines": 3}}, {"cam1": CAMERA, "cam2": CAMERA}, "run") == []
    assert lit_shape_findings({"cam3": {"height": 0.3, "height_sd": 0.01}}, {"cam1": CAMERA}, "run") == []
