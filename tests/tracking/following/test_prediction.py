import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.tracking.following.prediction import MOTION, predict

TIMES = np.arange(8.0)


@given(st.floats(-20, 20), st.floats(-3, 3), st.floats(1, 6))
@settings(max_examples=40, deadline=None)
def test_a_parabola_goes_on(speed, acceleration, ahead):
    path = 100 + speed * TIMES + acceleration * TIMES**2 / 2
    to = TIMES[-1] + ahead
    expected = 100 + speed * to + acceleration * to**2 / 2
    there = predict(TIMES, np.stack([path, path], -1)[:, None], np.array([to]))
    assert there[0, 0] == pytest.approx(expected, abs=0.05 * (1 + abs(acceleration)) * ahead)


def test_one_position_stays_and_two_go_on():
    positions = np.full((8, 2, 2), np.nan)
    positions[-1, 0] = 50, 60
    positions[-2:, 1] = [[10, 20], [14, 18]]
    there = predict(TIMES, positions, TIMES[-1] + np.array([1.0, 2.0]))
    assert there[:, 0] == pytest.approx(np.array([[50, 60], [50, 60]]), abs=1e-6)
    assert there[:, 1] == pytest.approx(np.array([[18, 16], [22, 14]]), abs=1.5)


def test_gaps_and_uneven_times_do_no_harm():
    times = np.array([0, 1, 2, 4, 5, 7, 8, 9.0])
    positions = np.stack([3 * times, -2 * times], -1)[:, None]
    positions[[2, 5]] = np.nan
    assert predict(times, positions, np.array([11.0]))[0, 0] == pytest.approx((33, -22), abs=0.05)


def test_a_target_never_seen_has_no_prediction():
    assert np.isnan(predict(TIMES, np.full((8, 1, 2), np.nan), np.array([9.0]))).all()


def test_long_lost_targets_are_not_sent_off_the_field():
    positions = np.stack([10 * TIMES, 0 * TIMES], -1)[:, None]
    far, limit = predict(TIMES, positions, TIMES[-1] + np.array([500.0, MOTION.longest]))
    assert far == pytest.approx(limit)


def orbit(times, period=45.0):
    return 12 * np.stack([np.cos(2 * np.pi * times / period), np.sin(2 * np.pi * times / period)], -1)[:, None]


def test_smooth_motion_is_foreseen_by_a_cubic():
    ahead = TIMES[-1] + np.arange(1.0, 6.0)
    off = np.abs(predict(TIMES, orbit(TIMES), ahead) - orbit(ahead)).max(axis=(1, 2))
    assert off[0] < 0.05
    assert off[-1] < 1


def test_each_target_has_the_curve_that_suits_it():
    rng = np.random.default_rng(0)
    shaken = np.cumsum(rng.normal(0, 1, (8, 40, 2)), axis=0)
    ahead = TIMES[-1] + np.array([1.0, 4.0])
    both = predict(TIMES, np.concatenate([orbit(TIMES), shaken], axis=1), ahead)
    assert both[:, :1] == pytest.approx(predict(TIMES, orbit(TIMES), ahead))
    parabola = predict(TIMES, np.concatenate([np.full((1, 40, 2), np.nan), shaken[1:]]), ahead)
    assert np.median(np.abs(both[1, 1:] - shaken[-1])) < 1.2 * np.median(np.abs(parabola[1] - shaken[-1]))
