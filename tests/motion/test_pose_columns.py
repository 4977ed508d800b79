"""Poses as columns: angles, their sigma, a quaternion, flags."""

import numpy as np

from vidtrack.motion.pose_columns import COLUMNS, pose_columns
from vidtrack.motion.rigid import rotation_from_roll_pitch_yaw


def columns(degrees, flag=""):
    n = len(degrees)
    R = rotation_from_roll_pitch_yaw(np.radians(degrees))
    C = np.broadcast_to(np.diag([1e-4, 4e-4, 9e-4, 1.0, 4.0, 9.0]), (n, 6, 6))
    return pose_columns("float", np.arange(n) / 30, "", np.zeros((n, 3)), R, C, np.zeros(n), [4] * n, [flag] * n)


def test_angles_and_sigmas_come_out_in_degrees():
    own = columns([[10.0, 5, 20], [11, 5, 20]])
    assert list(own) == list(COLUMNS)
    np.testing.assert_allclose([own[a][1] for a in ("roll", "pitch", "yaw")], [11, 5, 20])
    assert [own[f"sigma_{a}"][0] for a in "xyz"] == [1, 2, 3]
    level = columns([[0.0, 0, 0]])
    np.testing.assert_allclose(
        [level[f"sigma_{a}"][0] for a in ("roll", "pitch", "yaw")], np.degrees([0.01, 0.02, 0.03])
    )


def test_a_turn_past_a_half_goes_on():
    assert np.abs(np.diff(columns([[170.0, 0, 0], [179, 0, 0], [-172, 0, 0]])["roll"])).max() < 20


def test_pitch_near_a_right_angle_is_flagged_beside_other_flags():
    assert columns([[0.0, 89, 0], [0, 0, 0]], "misfit")["flag"] == ["misfit;vertical", "misfit"]
