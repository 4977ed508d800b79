"""Cameras tied to each other: their places are kept, the motion of the whole is left to the survey."""

import cv2
import numpy as np
import pytest

from tests.calibration.boards.test_board_fit import cameras
from vidtrack.calibration.adjustment.tied_cameras import TiedCameras, moved_camera, world_motion
from vidtrack.calibration.adjustment.unknowns import State, Unknowns
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.geometry.camera import project

FREE = free_parameters("tsai")
SD = np.array([1e-5] * 3 + [0.05] * 3 + [0.3, 1e-4, 0.2, 0.2, 1e-9])
R = cv2.Rodrigues(np.array([0.7, -0.4, 1.1]))[0]
T = np.array([300.0, -80.0, 1200.0])


def tied(scale_sd=0.0):
    return TiedCameras(cameras(2), [FREE, FREE], np.zeros(3), np.diag(np.concatenate([SD, SD]) ** 2), scale_sd)


def cost(tie, rig):
    equations = tie.equations(State(tuple(rig), {}, ()), Unknowns([FREE, FREE], np.array([50.0, 20.0, 900.0])))
    return float((equations.residual**2).sum())


def test_a_motion_of_the_whole_costs_nothing():
    assert cost(tied(), [moved_camera(camera, R, T) for camera in cameras(2)]) < 1e-12


def test_a_camera_that_moves_against_the_other_costs_what_its_sd_says():
    one, two = cameras(2)
    moved = two.with_(T=two.T + np.array([0.0, 0.5, 0.0]))
    own = cost(tied(), [one, moved])
    assert 10 < own < 100  # ten standard deviations of each camera, shared between both
    assert cost(tied(), [moved_camera(one, R, T), moved_camera(moved, R, T)]) == pytest.approx(own, rel=1e-6)


def test_the_scale_costs_what_is_known_of_it():
    grown = [camera.with_(T=1.001 * camera.T) for camera in cameras(2)]
    assert cost(tied(1e-3), grown) == pytest.approx(1.0, rel=0.2)
    assert cost(tied(), grown) > 20


def test_a_world_moves_to_that_in_which_a_camera_stands():
    camera = cameras(2)[1]
    found = world_motion(camera, moved_camera(camera, R, T))
    assert np.allclose(found[0], R)
    assert np.allclose(found[1], T)


def test_six_points_and_a_board_locate_to_the_floor_but_for_a_motion_of_the_whole():
    """The survey is good to 1 mm; distances come out to the noise of the pictures."""
    rng = np.random.default_rng(0)
    truth = [moved_camera(camera, R, T) for camera in cameras(2)]
    p = rng.uniform([-100, -80, 500], [250, 80, 900], (6, 3)) @ R.T + T
    b = np.array([project(c, p) for c in truth]) + rng.normal(0, 0.1, (2, 6, 2))
    start = [moved_camera(c, cv2.Rodrigues(rng.normal(0, 2e-3, 3))[0], rng.normal(0, 1.0, 3)) for c in truth]
    how = {"sigma": 1.0, "free": [FREE, FREE], "sd": 0.1, "scale_sd": False}
    found = bundle(start, p + rng.normal(0, 1.0, p.shape), b, tied=[tied(5e-4)], **how)
    one, two = (camera.R @ other.R.T for camera, other in (truth, found.cameras))
    assert np.degrees(np.linalg.norm(cv2.Rodrigues(one @ two.T)[0])) < 0.005
    apart = [np.linalg.norm(rig[0].position - rig[1].position) for rig in (truth, found.cameras)]
    assert apart[1] == pytest.approx(apart[0], rel=2e-3)
    assert found.converged
