"""Motions at named points, against a body that is turned and shifted on paper."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vidtrack.analysis.motions import basin_axes, before_motion, mean_rotation, motions_at, statistics, watch_circle

N = 200
T = np.arange(N) / 20


def swaying(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, heave=0.0):
    """A body whose axes lie askew in the world and which turns about the world's axes."""
    swing = np.sin(2 * np.pi * T)
    turn = Rotation.from_euler("ZYX", np.outer(swing, [yaw_deg, pitch_deg, roll_deg]), degrees=True).as_matrix()
    askew = Rotation.from_euler("ZYX", [30, 5, -3], degrees=True).as_matrix()
    origin = np.array([4.0, 5.0, 6.0]) + np.outer(heave * swing, [0, 0, 1])
    return origin, turn @ askew, swing


def test_angles_and_heave_come_out_as_put_in_whatever_the_body_s_own_axes():
    origin, R, swing = swaying(pitch_deg=4.0, heave=2.0)
    found = motions_at(origin, R, np.zeros((N, 6, 6)), [0, 0, 0], basin_axes("+x", "+z"))
    assert found.motion[:, 4] == pytest.approx(4.0 * swing, abs=1e-6)
    assert found.motion[:, 2] == pytest.approx(2.0 * swing, abs=1e-9)
    assert np.abs(found.motion[:, [0, 1, 3, 5]]).max() < 0.01


def test_waves_along_minus_y_turn_a_pitch_about_y_into_a_roll():
    origin, R, swing = swaying(pitch_deg=4.0)
    found = motions_at(origin, R, np.zeros((N, 6, 6)), [0, 0, 0], basin_axes("-y", "+z"))
    assert found.motion[:, 3] == pytest.approx(-4.0 * swing, abs=1e-6)
    assert np.abs(found.motion[:, 4]).max() < 1e-6


def test_up_may_point_along_minus_z():
    assert basin_axes("+x", "-z") == pytest.approx(np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]))
    with pytest.raises(ValueError, match="on one line"):
        basin_axes("+x", "-x")


def test_a_point_on_an_arm_moves_by_the_arm_times_the_turn():
    origin, R, swing = swaying(pitch_deg=1.0)
    R = R @ np.linalg.inv(R[0])  # body axes along the world's
    found = motions_at(origin, R, np.zeros((N, 6, 6)), [10, 0, 0], basin_axes("+x", "+z"))
    assert found.motion[:, 2] == pytest.approx(-10 * np.sin(np.radians(swing)), abs=1e-9)


def test_the_lever_arm_is_in_the_sigma():
    rng = np.random.default_rng(1)
    R = Rotation.from_rotvec(rng.normal(0, 1e-3, (N, 3))).as_matrix()
    covariance = np.zeros((N, 6, 6))
    covariance[:, [0, 1, 2], [0, 1, 2]] = 1e-6
    found = motions_at(np.zeros((N, 3)), R, covariance, [30, 0, 0], basin_axes("+x", "+z"))
    assert found.sigma[:, 1] == pytest.approx(0.03, rel=1e-3)
    assert np.std(found.motion[:, 1]) == pytest.approx(0.03, rel=0.15)
    assert np.std(found.motion[:, 4]) == pytest.approx(float(np.mean(found.sigma[:, 4])), rel=0.15)


def test_an_unknown_pose_stays_unknown():
    origin, R, _ = swaying(heave=2.0)
    R[10] = np.nan
    origin[10] = np.nan
    found = motions_at(origin, R, np.zeros((N, 6, 6)), [0, 0, 0], basin_axes("+x", "+z"))
    assert np.isnan(found.motion[10]).all()
    assert np.isfinite(np.delete(found.motion, 10, axis=0)).all()


def test_the_mean_of_opposite_small_turns_is_no_turn():
    R = Rotation.from_rotvec([[0.1, 0, 0], [-0.1, 0, 0]]).as_matrix()
    assert mean_rotation(R) == pytest.approx(np.eye(3), abs=1e-12)


def test_the_interval_of_a_mean_counts_how_long_a_record_lasts():
    rng = np.random.default_rng(2)
    inside = 0
    for _ in range(100):
        noise = np.convolve(rng.normal(0, 1, 2049), np.ones(50) / 50, "valid")
        mean = statistics(noise).mean
        inside += abs(mean.value) < mean.half_width
    assert 85 <= inside <= 99


def test_the_mean_of_a_motion_that_swings_is_known_better_than_by_half_cycles():
    """Six and a half cycles of amplitude 1.1 with noise 0.005, as the demo's float."""
    t = np.arange(0, 6.47, 1 / 29.97)
    x = 1.1 * np.cos(2 * np.pi * t + 0.7) + np.random.default_rng(3).normal(0, 0.005, t.size)
    found = statistics(x)
    assert abs(found.mean.value) < found.mean.half_width < 0.1
    assert abs(found.sd - 1.1 / np.sqrt(2)) < found.sd_half_width < 0.05
    assert abs(found.drift.value) < 0.05
    assert found.drift.half_width < 0.25


def test_the_intervals_of_a_narrow_sea_hold_mean_sd_and_drift():
    rng, f = np.random.default_rng(4), np.linspace(0.8, 1.2, 60)
    t, inside = np.arange(0, 60, 1 / 15), np.zeros(3)
    for _ in range(200):
        a, phase = rng.rayleigh(1, f.size), rng.uniform(0, 2 * np.pi, f.size)
        x = (a * np.cos(2 * np.pi * np.outer(t, f) + phase)).sum(1)
        found = statistics(x)
        truth = np.sqrt(f.size)  # the mean of a^2/2 is 1
        inside += [
            abs(found.mean.value) < found.mean.half_width,
            abs(found.sd - truth) < found.sd_half_width,
            abs(found.drift.value) < found.drift.half_width,
        ]
    assert (inside >= 180).all(), inside
    assert found.mean.half_width < 0.3 * found.sd / np.sqrt(15)


def test_a_drift_is_the_change_of_the_mean():
    found = statistics(np.linspace(0, 1, 400) + np.random.default_rng(0).normal(0, 0.01, 400))
    assert found.drift.value == pytest.approx(0.75, abs=0.01)
    assert statistics([1.0, 2.0]).n == 2
    assert np.isnan(statistics([1.0, 2.0]).sd)


def test_the_watch_circle_holds_the_farthest_excursion():
    radius, hull = watch_circle(np.array([[0, 0, 9.0], [3, 4, 9], [1, -1, 9], [0.5, 0.5, 9], [np.nan, 0, 0]]))
    assert radius == pytest.approx(5)
    assert len(hull) == 3


def test_statistics_carry_the_sigma_of_their_extremes_and_the_width_of_sd():
    rng = np.random.default_rng(8)
    x = rng.normal(0, 2.0, 4000)
    sigma = np.where(x == x.max(), 0.5, 0.1)
    found = statistics(x, sigma)
    assert found.most_half_width == pytest.approx(1.96 * 0.5)
    assert found.least_half_width == pytest.approx(1.96 * 0.1)
    assert found.sigma == pytest.approx(0.1)
    assert found.sd_half_width == pytest.approx(1.96 * 2 / np.sqrt(2 * 4000), rel=0.1)
    assert np.isnan(statistics(x).sigma)


def test_the_interval_of_sd_holds_the_truth_where_samples_are_correlated():
    rng = np.random.default_rng(9)
    inside = 0
    for _ in range(100):
        noise = rng.normal(0, 1, 3000)
        x = np.convolve(noise, np.ones(20) / np.sqrt(20), "valid")
        found = statistics(x)
        inside += abs(found.sd - 1) < found.sd_half_width
    assert 88 <= inside


def test_rest_is_what_comes_before_the_motion():
    rng = np.random.default_rng(10)
    t = np.arange(0, 10, 0.02)
    motion = rng.normal(0, 0.01, (t.size, 6))
    motion[:, 2] += np.where(t > 3, np.sin(t - 3), 0)
    motion[40] = np.nan
    sigma = np.full((t.size, 6), 0.01)
    rest = before_motion(t, motion, sigma)
    assert 2.5 < t[rest].max() < 3.1
    assert not rest[40]
    motion[:, 2] = np.sin(t)
    assert not before_motion(t, motion, sigma).any() or t[before_motion(t, motion, sigma)].max() < 0.2
    assert not before_motion(t, np.zeros((t.size, 6)) * np.nan, sigma).any()
