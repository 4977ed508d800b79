"""What is sought stands where it is said to stand, and takes a step as its derivatives say."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment.unknowns import (
    State,
    Unknowns,
    columns,
    free_blocks,
    moved_poses,
    points_of_poses,
    pose_blocks,
)
from vidtrack.simulate.rig import thesis_rig


def test_shared_parameters_follow_those_of_the_cameras():
    unknowns = Unknowns([("f", "omega_x"), ("Cx",)], np.zeros(3), ("length", "tilt"))
    assert unknowns.free == (("omega_x", "f"), ("Cx",))
    assert unknowns.size == 5
    assert unknowns.of_camera(1)[0].tolist() == [2]
    assert unknowns.of_shared("tilt", "fixed", "length").tolist() == [4, 3]
    with pytest.raises(ValueError, match="no camera parameter"):
        columns([("focal",)])


def test_a_step_moves_cameras_shared_parameters_and_blocks_and_changes_nothing_in_place():
    camera = thesis_rig(1)[0]
    unknowns = Unknowns([("f",)], np.zeros(3), ("length",))
    start = State((camera,), {"length": 2.0, "fixed": 5.0}, (np.zeros((2, 3)),))
    family = free_blocks(np.zeros((2, 3)))
    after = unknowns.stepped(start, [family], np.array([0.5, 0.25]), [np.ones((2, 3))])
    assert after.cameras[0].f == camera.f + 0.5
    assert after.shared == {"length": 2.25, "fixed": 5.0}
    assert (after.blocks[0] == 1).all()
    assert start.shared["length"] == 2.0
    assert (start.blocks[0] == 0).all()


def test_points_of_a_pose_move_as_its_derivatives_say():
    rng = np.random.default_rng(0)
    values = moved_poses(np.tile(np.eye(3, 4), (5, 1, 1)), rng.normal(0, 1, (5, 6)))
    np.testing.assert_allclose(
        values[..., :3] @ values[..., :3].swapaxes(-1, -2), np.tile(np.eye(3), (5, 1, 1)), atol=1e-12
    )
    body = rng.normal(0, 1, (4, 3))
    p, J = points_of_poses(values, body)
    for k in range(6):
        step = np.zeros((5, 6))
        step[:, k] = 1e-6
        moved = points_of_poses(moved_poses(values, step), body)[0]
        np.testing.assert_allclose((moved - p) / 1e-6, J[..., k], atol=1e-5)
    assert pose_blocks(5).prior(values).information.sum() == 0
