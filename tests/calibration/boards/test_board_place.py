"""From a board's world to that of the survey."""

import cv2
import numpy as np

from tests.calibration.boards.test_board_fit import cameras
from vidtrack.calibration.adjustment.tied_cameras import moved_camera
from vidtrack.calibration.boards.board_place import survey_motion
from vidtrack.geometry.camera import project

R, T = cv2.Rodrigues(np.array([0.3, 1.2, -0.4]))[0], np.array([500.0, -200.0, 90.0])


def sights(i, n, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    p = rng.uniform([-100, -80, 500], [200, 80, 900], (n, 3)) @ R.T + T
    b = project(moved_camera(cameras(2)[i], R, T), p) + rng.normal(0, noise, (n, 2))
    return p, b


def test_the_camera_that_its_points_place_best_decides():
    rig = dict(zip(("a", "b"), cameras(2), strict=True))
    found = survey_motion(rig, "tsai", {"a": sights(0, 6, noise=3.0), "b": sights(1, 6)})
    assert np.allclose(found[0], R, atol=1e-6)
    assert np.allclose(found[1], T, atol=1e-3)


def test_three_points_say_nothing():
    rig = {"a": cameras(2)[0]}
    assert survey_motion(rig, "tsai", {"a": sights(0, 3)}) is None
