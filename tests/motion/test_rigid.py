import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.geometry.triangulate import locate_points
from vidtrack.motion.rigid import (
    angles_by_turn,
    fit_pose,
    quaternion,
    roll_pitch_yaw,
    rotation_from_roll_pitch_yaw,
    unwrapped,
)
from vidtrack.simulate.rig import thesis_rig

FLOAT = 9 * np.array([[1, 0, 0.3], [-0.5, 0.75**0.5, 0.3], [-0.5, -(0.75**0.5), 0.3]])
"""Three targets on the rim of the thesis's 18 in float, measured from its middle, in."""

angle = st.floats(-1.5, 1.5)


def voyage(n=300):
    """Roll, pitch, yaw (rad) and origin (in) of a float that rolls, pitches and turns about once."""
    t = np.arange(n) / 30
    angles = np.radians(np.stack([8 * np.sin(t), 5 * np.sin(1.3 * t + 1), 40 * t], -1))
    return angles, np.stack([10 * np.sin(t), 3 * np.cos(t), 2 * np.sin(2 * t)], -1)


def targets(angles, origin, body=FLOAT):
    return origin[:, None] + body @ np.swapaxes(rotation_from_roll_pitch_yaw(angles), -1, -2)


def wrapped(a):
    return np.angle(np.exp(1j * a))


def test_a_shift_turns_nothing():
    pose = fit_pose(FLOAT + np.array([1, 2, 3]), FLOAT)
    assert pose.origin == pytest.approx([1, 2, 3])
    assert pytest.approx(np.eye(3), abs=1e-12) == pose.R


def test_a_quarter_turn_to_the_left_is_a_yaw_of_90_degrees():
    R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert np.degrees(roll_pitch_yaw(R)) == pytest.approx([0, 0, 90])
    assert quaternion(R[None])[0] == pytest.approx([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])


@settings(max_examples=40, deadline=None)
@given(st.tuples(angle, angle, angle))
def test_angles_are_intrinsic_z_y_x_as_scipy_counts_them(angles):
    R = rotation_from_roll_pitch_yaw(angles)
    witness = Rotation.from_euler("ZYX", angles[::-1])
    assert witness.as_matrix() == pytest.approx(R, abs=1e-12)
    assert roll_pitch_yaw(R) == pytest.approx(angles, abs=1e-9)
    assert rotation_from_vector(witness.as_rotvec()) == pytest.approx(R, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.tuples(angle, angle, angle), st.integers(3, 7), st.integers(0, 99))
def test_any_pose_of_any_body_is_found_exactly(angles, n, seed):
    body = np.random.default_rng(seed).normal(size=(n, 3))
    R, origin = rotation_from_roll_pitch_yaw(angles), np.array([5.0, -7, 2])
    pose = fit_pose(body @ R.T + origin, body)
    assert pytest.approx(R, abs=1e-8) == pose.R
    assert pose.origin == pytest.approx(origin, abs=1e-8)
    assert pose.rms < 1e-9


def test_three_targets_are_never_taken_for_their_mirror_image():
    rng, (angles, origin) = np.random.default_rng(1), voyage()
    pose = fit_pose(targets(angles, origin) + rng.normal(0, 0.5, (300, 3, 3)), FLOAT)
    assert np.linalg.det(pose.R) == pytest.approx(np.ones(300))


@pytest.mark.parametrize(("noise", "degrees", "inches"), [(0.004, 0.025, 0.004), (0.009, 0.055, 0.007)])
def test_a_float_of_18_in_is_known_to_a_twentieth_of_a_degree_and_a_fiftieth_of_an_inch(noise, degrees, inches):
    """Noise of each located coordinate, in: 0.004 as 0.02 px in both of the thesis's cameras makes, and twice that."""
    rng, (angles, origin) = np.random.default_rng(2), voyage()
    pose = fit_pose(targets(angles, origin) + rng.normal(0, noise, (300, 3, 3)), FLOAT, np.full((300, 3, 3), noise))
    turn = np.degrees(wrapped(roll_pitch_yaw(pose.R) - angles))
    assert degrees / 3 < np.sqrt((turn**2).mean()) < degrees
    assert inches / 3 < np.sqrt(((pose.origin - origin) ** 2).mean()) < inches


def test_seen_by_the_thesis_s_cameras_a_float_is_known_to_0_05_degrees_and_0_02_in():
    """Centroids to 0.02 px, twice what tracking a 4 px ball attains; 0.05 px would just do."""
    rng, (angles, origin) = np.random.default_rng(3), voyage()
    true, cameras = targets(angles, origin), thesis_rig()
    b = np.stack([project(c, true) + rng.normal(0, 0.02, (300, 3, 2)) for c in cameras])
    located = locate_points(cameras, b, sd=0.02)
    pose = fit_pose(located.point, FLOAT, located.covariance)
    turn = np.degrees(wrapped(roll_pitch_yaw(pose.R) - angles))
    assert 0.005 < np.sqrt((turn**2).mean()) < 0.03
    assert np.abs(turn).max() < 0.1
    assert 0.001 < np.sqrt(((pose.origin - origin) ** 2).mean()) < 0.02
    assert 0.85 < pose.excess.mean() < 1.15


def test_the_stated_uncertainty_is_the_error():
    rng, (angles, origin) = np.random.default_rng(4), voyage(2000)
    sigma = np.broadcast_to([0.01, 0.02, 0.03], (2000, 3, 3))
    pose = fit_pose(targets(angles, origin) + rng.normal(size=sigma.shape) * sigma, FLOAT, sigma)
    turn = wrapped(roll_pitch_yaw(pose.R) - angles)
    B = angles_by_turn(roll_pitch_yaw(pose.R))
    sd = np.sqrt(np.diagonal(B @ pose.covariance[:, :3, :3] @ np.swapaxes(B, 1, 2), axis1=1, axis2=2))
    shift_sd = np.sqrt(np.diagonal(pose.covariance[:, 3:, 3:], axis1=1, axis2=2))
    assert (turn / sd).std(0) == pytest.approx(np.ones(3), abs=0.06)
    assert ((pose.origin - origin) / shift_sd).std(0) == pytest.approx(np.ones(3), abs=0.06)


def test_angles_change_with_a_turn_as_their_derivative_says():
    angles = np.array([0.4, -0.7, 2.1])
    R, step = rotation_from_roll_pitch_yaw(angles), 1e-6
    for k, axis in enumerate(np.eye(3)):
        change = (
            roll_pitch_yaw(rotation_from_vector(step * axis) @ R)
            - roll_pitch_yaw(rotation_from_vector(-step * axis) @ R)
        ) / (2 * step)
        assert change == pytest.approx(angles_by_turn(angles)[:, k], abs=1e-6)


def test_a_point_far_from_the_targets_is_known_less_well():
    """Lever arm: 36 in above the targets, 0.05 degrees are 0.03 in."""
    far = FLOAT - [0, 0, FLOAT[0, 2] + 36.0]
    near, away = (fit_pose(b, b, np.full((3, 3), 0.01)).covariance[3, 3] for b in (FLOAT, far))
    turn = fit_pose(FLOAT, FLOAT, np.full((3, 3), 0.01)).covariance[1, 1]
    assert away > 10 * near
    assert away == pytest.approx(0.01**2 / 3 + 36.0**2 * turn, rel=0.1)


def test_a_missing_target_is_tolerated_where_three_remain():
    body = np.vstack([FLOAT, [0, 0, 5]])
    (angles, origin) = voyage(10)
    p = targets(angles, origin, body)
    p[3, 0] = p[7, [0, 1]] = np.nan
    pose = fit_pose(p, body)
    assert pose.n_targets.tolist() == [4, 4, 4, 3, 4, 4, 4, 2, 4, 4]
    assert np.isnan(pose.R[7]).all()
    assert np.isnan(pose.origin[7]).all()
    assert np.abs(np.delete(pose.origin - origin, 7, 0)).max() < 1e-9


def test_targets_on_a_line_fix_no_attitude():
    body = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 3, 0.0]])
    p = body[None].repeat(2, 0).copy()
    p[1, 3] = np.nan
    pose = fit_pose(p, body)
    assert pose.collinear.tolist() == [False, True]
    assert np.isnan(pose.R[1]).all()
    with pytest.raises(ValueError, match="not lie on one line"):
        fit_pose(p[:, :3], body[:3])


def test_two_targets_are_refused():
    with pytest.raises(ValueError, match="needs three targets"):
        fit_pose(np.zeros((2, 3)), np.zeros((2, 3)))


def test_a_slipped_target_shows_in_the_misfit():
    p = FLOAT.copy()
    p[0] += [0.5, 0, 0]
    assert fit_pose(p, FLOAT, np.full((3, 3), 0.01)).excess > 50


def test_angles_unwrap_over_missing_samples():
    a = np.radians([170.0, 175, np.nan, 185, 200, -150 + 360])
    assert np.degrees(unwrapped(wrapped(a))) == pytest.approx([170, 175, np.nan, 185, 200, 210], nan_ok=True)


def test_quaternions_keep_their_sign_through_a_whole_turn():
    angles, _ = voyage(600)
    q = quaternion(rotation_from_roll_pitch_yaw(angles))
    assert np.abs(np.diff(q, axis=0)).max() < 0.05
    assert np.linalg.norm(q, axis=1) == pytest.approx(np.ones(600))
