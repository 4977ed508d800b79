"""Between samples a track is a cubic; across a gap it is nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.timing.resample import common_times, exposures_begun, interval, resample

T = np.arange(20) / 30


def test_a_moment_on_a_sample_gets_the_sample_itself():
    x = np.random.default_rng(0).normal(size=(20, 2))
    x[7] = np.nan
    moved = resample(T, x, T[[3, 7, 19]] + [0, 0, 1e-6])
    assert np.array_equal(moved.values, x[[3, 7, 19]], equal_nan=True)
    assert moved.gain[0] == 1
    assert np.isnan(moved.gain[1])
    assert moved.before.tolist() == moved.after.tolist() == [3, 7, 19]


@settings(max_examples=50)
@given(
    st.lists(st.floats(-100, 100), min_size=4, max_size=4),
    st.lists(st.floats(0, 0.999), min_size=20, max_size=20),
)
def test_a_cubic_is_reproduced_whatever_the_moments(coefficients, jitter):
    t = (np.arange(20) + 0.3 * np.array(jitter)) / 30
    at = np.linspace(t[0], t[-1], 57)
    moved = resample(t, np.polyval(coefficients, t)[:, None], at)
    between = moved.before != moved.after
    assert moved.values[between, 0] == pytest.approx(np.polyval(coefficients, at[between]), abs=1e-8)


def test_a_swing_of_the_demo_is_kept_to_a_thousandth_of_an_inch():
    t = np.arange(300) / 30
    at = t[5:-5] + 0.5 / 30

    def swing(t):
        return 24 * np.exp(-0.1 * t) * np.cos(2 * np.pi * t / 1.6)

    error = np.abs(resample(t, swing(t)[:, None], at).values[:, 0] - swing(at))
    assert error.max() < 0.001
    assert error.max() > 1e-5  # 3/128 h^4 w^4 of 24 in is 1.6e-4


def test_gaps_and_ends_are_not_bridged():
    x = np.arange(20.0)[:, None].repeat(2, 1)
    x[8] = np.nan
    at = np.array([-0.01, T[7] + 0.01, T[8], T[8] + 0.01, T[9] + 0.01, T[19] + 0.01])
    assert np.isfinite(resample(T, x, at).values[:, 0]).tolist() == [False, False, False, False, True, False]
    without = np.delete(np.arange(20), [8, 9])  # rows that are not there are a gap as well
    moved = resample(T[without], x[without], np.array([T[8], T[8] + 0.01, T[10] + 0.01]))
    assert np.isfinite(moved.values[:, 0]).tolist() == [False, False, True]


def test_two_samples_alone_tell_nothing_between_them():
    x = np.full((20, 1), np.nan)
    x[4:6] = 1.0
    assert np.isnan(resample(T, x, [T[4] + 0.01]).values).all()
    x[6] = 1.0
    assert resample(T, x, [T[4] + 0.01]).values[0, 0] == pytest.approx(1)


def test_the_noise_of_resampled_values_is_told():
    rng = np.random.default_rng(1)
    x = rng.normal(size=(4000, 20, 1))
    for at in (T[10] + 0.5 / 30, T[10] + 0.2 / 30, T[0] + 0.4 / 30):
        moved = resample(T, x, [at])
        assert moved.values.std() == pytest.approx(moved.gain[0, 0], rel=0.04)
    # 2 (9/16)^2 + 2 (1/16)^2 of the variance remains midway
    assert resample(T, x, [T[10] + 0.5 / 30]).gain[0, 0] == pytest.approx(np.sqrt(164) / 16)


def test_times_must_rise_and_shapes_match():
    with pytest.raises(ValueError, match="rise"):
        resample([0, 0, 1], np.zeros((3, 2)), [0.5])
    with pytest.raises(ValueError, match="must be"):
        resample([0, 1], np.zeros((3, 2)), [0.5])


def test_nothing_comes_of_nothing():
    assert np.isnan(resample([], np.zeros((4, 0, 2)), [0.5]).values).all()
    assert np.isnan(resample([1.0], np.ones((1, 2)), [0.5]).values).all()
    assert resample([1.0], np.ones((1, 2)), [1.0]).values[0, 0] == 1
    assert np.isnan(interval([1.0]))


def test_locked_cameras_share_their_moments():
    at, whose = common_times([T, T + 1e-9, T[:15]])
    assert at == pytest.approx(T)
    assert (whose == 0).all()


def test_the_moments_of_another_camera_fill_in_where_the_first_has_none():
    early, late = T[:15], T[8:] + 0.4 / 30
    at, whose = common_times([early, late])
    assert (np.diff(at) > 0.7 / 30).all()
    assert at[0] == T[0]
    assert at[-1] == pytest.approx(late[-1])
    assert set(whose.tolist()) == {0, 1}
    assert len(common_times([np.zeros(0), np.zeros(0)])[0]) == 0


def test_a_gap_does_not_change_the_usual_interval():
    assert interval(np.concatenate([np.arange(10), 50 + np.arange(10)]) / 30) == pytest.approx(1 / 30)
    assert np.isnan(interval([1.0]))


def test_two_stills_are_two_moments_unless_they_are_one():
    assert common_times([[1.0], [5.0]])[0].tolist() == [1.0, 5.0]
    assert common_times([[1.0], [1.0]])[0].tolist() == [1.0]


def test_an_exposure_begins_half_an_interval_before_its_middle():
    assert exposures_begun([1.0, 1.04, 1.08, 1.2]) == pytest.approx([0.98, 1.02, 1.06, 1.18])
    assert np.isnan(exposures_begun([1.0])).all()
