import numpy as np
import pytest

from vidtrack.motion.lag import agreement, find_lag, long_run_covariance, masked_correlation

SENSOR = 0.0625
"""in, the string potentiometer of the thesis (6.2), taken as a standard deviation."""
VIDEO = 0.012
"""in, a coordinate located by the thesis's rig from centroids good to 0.05 px."""


def pluck(t):
    return np.where(t > 0, 24 * np.exp(-0.25 * t) * np.cos(2 * np.pi * 0.9 * t), 24.0)


def forced(t):
    """By hand, about one second a turn: never quite regular."""
    return 10 * np.sin(2 * np.pi * t + 0.4 * np.sin(0.7 * t)) + 0.5 * np.sin(5 * t)


def records(motion, rng, *, lag=0.2, n=300, rate=30.0, sensor=SENSOR, video=VIDEO):
    """Times and values of the sensor, then of the video, which shows the motion later."""
    t = np.arange(n) * 1001 / 30000
    tr = np.arange(-2, t[-1] + 2, 1 / rate) + rng.uniform(0, 1 / 30)
    return tr, motion(tr) + rng.normal(0, sensor, len(tr)), t, motion(t - lag) + rng.normal(0, video, n)


@pytest.mark.slow
@pytest.mark.parametrize("motion", [pluck, forced])
@pytest.mark.parametrize("rate", [12.0, 30.0, 200.0])
def test_the_thesis_s_lag_of_0_2_s_is_found_to_a_thousandth(motion, rate):
    """Asked for: 0.005 s. A fifth of a millisecond is what the noise allows: 0.0625 in at some 60 in/s, 300 samples."""
    rng = np.random.default_rng(1)
    errors = [find_lag(*records(motion, rng, rate=rate)).lag_s - 0.2 for _ in range(3)]
    assert np.abs(errors).max() < 0.001
    assert np.abs(errors).max() > 1e-6


def test_the_confidence_interval_holds_as_often_as_it_says():
    rng = np.random.default_rng(2)
    found = [find_lag(*records(m, rng, n=150)) for m in (pluck, forced) for _ in range(14)]
    z = np.array([(f.lag_s - 0.2) / f.sd for f in found])
    # 240 trials gave 1.02 and 95 %; twenty-eight may stray by a tenth
    assert 0.75 < z.std() < 1.3
    assert np.mean([f.low < 0.2 < f.high for f in found]) > 0.85
    assert np.mean([f.high - f.low for f in found]) < 0.002


@pytest.mark.parametrize("lag", [-1.37, -0.004, 0.0, 0.211, 2.4])
def test_lags_of_either_sign_and_of_parts_of_a_sample_are_found(lag):
    rng = np.random.default_rng(3)
    t = np.arange(900) / 30
    tr = np.arange(-5, 35, 1 / 50)
    y = pluck(t - 3 - lag) + rng.normal(0, VIDEO, 900)
    found = find_lag(tr, pluck(tr - 3) + rng.normal(0, SENSOR, len(tr)), t, y)
    assert found.lag_s == pytest.approx(lag, abs=0.001)


def test_a_steady_oscillation_has_other_lags_as_likely_and_the_shortest_is_taken():
    rng = np.random.default_rng(4)

    def steady(t):
        return 10 * np.sin(2 * np.pi * t)

    found = find_lag(*records(steady, rng))
    assert found.lag_s == pytest.approx(0.2, abs=0.002)
    assert any(abs(o - (-0.8)) < 0.02 for o in found.others)
    assert find_lag(*records(steady, rng), longest=0.4).others == (pytest.approx(-0.3, abs=0.01),)


def test_a_sensor_that_counts_backwards_correlates_negatively():
    rng = np.random.default_rng(5)
    tr, r, t, y = records(pluck, rng)
    found = find_lag(tr, -r, t, y)
    assert found.lag_s == pytest.approx(0.2, abs=0.001)
    assert found.correlation < -0.999


def test_a_steady_motion_is_not_turned_round_by_an_error_of_two_thousandths():
    rng = np.random.default_rng(9)
    tr, t = np.arange(-0.5, 2.5, 1 / 30), np.arange(0, 2, 1 / 30)
    y = 8 * np.sin(3.2 * t) + 0.08 * np.exp(-t / 0.3)
    found = find_lag(tr, 8 * np.sin(3.2 * tr) + rng.normal(0, 0.01, len(tr)), t, y)
    assert found.correlation > 0.999
    assert found.lag_s == pytest.approx(0, abs=0.01)
    assert any(abs(abs(other) - np.pi / 3.2) < 0.05 for other in found.others)


def test_the_lag_itself_is_no_other_lag():
    rng = np.random.default_rng(11)
    tr, r, t, y = records(pluck, rng)
    found = find_lag(tr, np.round(r), t, y)
    assert all(abs(other - found.lag_s) > 0.01 for other in found.others)


def test_gaps_in_both_records_do_no_harm():
    rng = np.random.default_rng(6)
    tr, r, t, y = records(forced, rng)
    r[100:130] = np.nan
    y[40:70] = np.nan
    y[200] += 8
    assert find_lag(tr, r, t, y).lag_s == pytest.approx(0.2, abs=0.001)


def test_a_slow_vibration_widens_the_interval():
    """Residuals that hang together prove less than their number suggests."""
    rng = np.random.default_rng(7)
    tr, r, t, y = records(pluck, rng)
    calm, shaken = find_lag(tr, r, t, y), find_lag(tr, r, t, y + 0.3 * np.sin(2 * np.pi * 0.8 * t + 1))
    assert shaken.sd > 3 * calm.sd
    assert abs(shaken.lag_s - 0.2) < 3 * shaken.sd + 0.001


def test_records_at_rest_have_no_lag():
    t = np.arange(100) / 30
    assert np.isnan(find_lag(t, np.zeros(100), t, np.sin(t)).lag_s)


def test_records_that_hardly_overlap_have_no_lag():
    t = np.arange(100) / 30
    assert np.isnan(find_lag(t, np.sin(t), t[:6], np.sin(t[:6])).lag_s)


def test_masked_correlation_is_pearson_s_over_what_both_have():
    rng = np.random.default_rng(8)
    x, y = rng.normal(size=30), rng.normal(size=40)
    x[[3, 4]] = y[[10, 20]] = np.nan
    r, n, k = masked_correlation(x, y)
    for shift in (-20, 0, 7, 25):
        pairs = [(x[i], y[i + shift]) for i in range(30) if 0 <= i + shift < 40]
        pairs = np.array([p for p in pairs if np.isfinite(p).all()])
        at = int(np.flatnonzero(k == shift)[0])
        assert n[at] == len(pairs)
        assert r[at] == pytest.approx(np.corrcoef(pairs.T)[0, 1], abs=1e-9)


def test_agreement_on_paper():
    x = np.array([0.0, 1, 2, 3])
    a = agreement(x, 2 * x + 1)
    assert (a.gain, a.bias, a.correlation, a.n) == (pytest.approx(2), pytest.approx(1), pytest.approx(1), 4)
    assert a.rms == pytest.approx(np.sqrt((1 + 4 + 9 + 16) / 4))
    assert a.max_abs == pytest.approx(4)
    assert a.mean_difference == pytest.approx(2.5)
    assert a.rms_fit == pytest.approx(0, abs=1e-12)


def test_agreement_leaves_pairs_with_nan_out():
    x, y = np.arange(10.0), np.arange(10.0)
    y[3] = np.nan
    assert agreement(x, y).n == 9
    assert np.isnan(agreement(x[:2], y[:2]).gain)


def test_white_residuals_give_the_textbook_covariance():
    rng = np.random.default_rng(9)
    J = rng.normal(size=(5000, 2))
    r = rng.normal(0, 0.3, 5000)
    assert np.sqrt(np.diag(long_run_covariance(J, r, np.arange(5000)))) == pytest.approx(0.3 / np.sqrt(5000), rel=0.1)


def test_correlated_residuals_are_counted_as_few():
    """A first-order process of memory 0.9 has (1 + 0.9)/(1 - 0.9) = 19 times the variance of its mean."""
    rng = np.random.default_rng(10)
    e = rng.normal(size=20000)
    r = np.zeros(20000)
    for i in range(1, 20000):
        r[i] = 0.9 * r[i - 1] + e[i]
    ratio = long_run_covariance(np.ones((20000, 1)), r, np.arange(20000))[0, 0] / (r.var() / 20000)
    assert 10 < ratio < 22


def test_a_motion_that_begins_all_at_once_has_its_lag_although_no_spline_follows_the_corner():
    """Other lags, a period off, leave the beginning out: they seemed to explain the rest better, and one was taken."""

    def motion(t):
        return 8 * np.sin(2 * np.pi * 0.796 * np.maximum(t, 0) - 1.0)

    for seed in range(4):
        rng = np.random.default_rng(seed)
        t, tr = np.arange(90) / 30, np.arange(-0.7, 3.2, 1 / 30)
        found = find_lag(tr, motion(tr) + rng.normal(0, 0.03, len(tr)), t + 0.2, motion(t) + rng.normal(0, 0.002, 90))
        assert found.lag_s == pytest.approx(0.2, abs=0.002)
        assert any(other == pytest.approx(0.2 - 1 / 0.796, abs=0.01) for other in found.others)
