"""What a camera at rest would have seen: exact for a known movement, and as uncertain as the movement is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.steadiness.scenes import camera
from vidtrack.steadiness.follow import movement_at, undone
from vidtrack.steadiness.turn import law_of_camera

LAW = law_of_camera(camera())


@given(st.lists(st.floats(-0.05, 0.05), min_size=4, max_size=4))
def test_a_movement_is_undone_exactly(theta):
    b = np.random.default_rng(0).uniform(20, 220, (9, 2))
    theta = np.array(theta) * [1, 1, 1, 0.4]
    many = np.broadcast_to(theta, (9, 4))
    rest = undone(LAW, LAW(b, theta), many, np.zeros((9, 4, 4)))
    assert rest.b == pytest.approx(b, abs=1e-6)
    assert rest.variance == pytest.approx(0)


def test_the_uncertainty_of_the_movement_is_carried():
    rng = np.random.default_rng(1)
    b, covariance = np.array([[100.0, 80.0]]), np.diag([1e-4, 2e-4, 3e-4, 1e-4]) ** 2
    drawn = rng.multivariate_normal(np.zeros(4), covariance, 4000)
    seen = undone(LAW, np.broadcast_to(b, (4000, 2)), drawn, np.zeros((4000, 4, 4))).b
    stated = undone(LAW, b, np.zeros((1, 4)), covariance[None]).variance[0]
    assert seen.var(0) == pytest.approx(stated, rel=0.1)


def test_missing_positions_stay_missing():
    rest = undone(LAW, np.array([[np.nan, np.nan], [50.0, 50.0]]), np.zeros((2, 4)), np.zeros((2, 4, 4)))
    assert np.isnan(rest.b[0]).all()
    assert np.isfinite(rest.b[1]).all()


def test_between_two_moments_the_step_may_have_happened_at_any_time():
    time, theta = np.array([0.0, 1.0]), np.array([[0.0, 0, 0, 0], [0.02, 0, 0, 0]])
    at, spread = movement_at(time, theta, np.zeros((2, 4, 4)), np.array([-1.0, 0.0, 0.5, 1.0, 3.0]))
    assert at[:, 0] == pytest.approx([0, 0, 0.01, 0.02, 0.02])
    assert np.sqrt(spread[:, 0, 0]) == pytest.approx([0, 0, 0.01, 0, 0])


def test_moments_without_a_movement_are_passed_over():
    time = np.array([0.0, 1.0, 2.0])
    theta = np.array([[0.0] * 4, [np.nan] * 4, [0.0] * 4])
    at, _ = movement_at(time, theta, np.zeros((3, 4, 4)), np.array([1.0]))
    assert at[0] == pytest.approx(0)
    none, _ = movement_at(time, np.full((3, 4), np.nan), np.zeros((3, 4, 4)), np.array([1.0]))
    assert np.isnan(none).all()
