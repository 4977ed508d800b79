import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.motion.smoothing import _Record, between, pieces, smooth

RATE = 30.0


def pluck(t, amplitude=24.0, hz=0.9, decay=0.1):
    """The thesis's damped oscillation: position, velocity, acceleration."""
    z = -decay + 2j * np.pi * hz
    f = amplitude * np.exp(z * t)
    return np.stack([f.real, (z * f).real, (z * z * f).real], -1)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 4), st.integers(8, 60), st.floats(0.001, 10))
def test_a_polynomial_comes_back_with_its_derivatives(degree, n, step):
    t = np.arange(n) * step
    c = np.random.default_rng(degree + n).normal(size=degree + 1) / (n * step) ** np.arange(degree + 1)
    p = np.polynomial.Polynomial(c)
    state = smooth(t, p(t)).state
    scale = np.abs(c).sum() + 1
    for k, f in enumerate((p, p.deriv(1), p.deriv(2))):
        assert np.abs(state[:, k] - f(t)).max() < 1e-5 * scale * (6 / step) ** k


@pytest.mark.parametrize("noise", [0.004, 0.02, 0.1, 0.5])
def test_velocity_and_acceleration_are_far_better_than_finite_differences(noise):
    """24 in at 0.9 Hz and 30 samples a second, noise of the thesis's order (0.02) and to either side."""
    t = np.arange(600) / RATE
    true = pluck(t)
    y = true[:, 0] + np.random.default_rng(3).normal(0, noise, 600)
    inner = slice(20, -20)
    error = (smooth(t, y).state - true)[inner].std(0)
    v = np.gradient(y, t)[inner]
    a = ((y[2:] - 2 * y[1:-1] + y[:-2]) * RATE**2)[19:-19]
    assert error[0] < 0.65 * noise
    assert error[1] < (v - true[inner, 1]).std() / 7
    assert error[2] < (a - true[inner, 2]).std() / 25
    # From below: with 600 samples and this motion nobody can do better than a 13-parameter fit.
    assert error[0] > 0.1 * noise


def test_the_stated_deviations_are_the_errors():
    t = np.arange(300) / RATE
    true, inner = pluck(t), slice(15, -15)
    z = []
    for seed in range(8):
        y = true[:, 0] + np.random.default_rng(seed).normal(0, 0.05, 300)
        smoothed = smooth(t, y)
        z.append(((smoothed.state - true) / smoothed.sd)[inner])
    assert (np.std(np.concatenate(z), axis=0) > 0.8).all()
    assert (np.std(np.concatenate(z), axis=0) < 1.35).all()


def test_the_record_tells_its_own_noise():
    t = np.arange(400) / RATE
    y = pluck(t)[:, 0] + np.random.default_rng(5).normal(0, 0.06, 400)
    assert smooth(t, y).noise_sd == pytest.approx(0.06, rel=0.1)
    assert smooth(t, y, np.full(400, 0.03)).noise_ratio == pytest.approx(2, rel=0.1)


def test_known_noise_is_believed():
    t = np.arange(400) / RATE
    y = pluck(t)[:, 0] + np.random.default_rng(5).normal(0, 0.06, 400)
    told = smooth(t, y, 0.06, noise="known")
    assert told.noise_sd == pytest.approx(0.06)
    assert np.sqrt(np.mean((told.state[20:-20, 0] - pluck(t)[20:-20, 0]) ** 2)) < 0.04
    with pytest.raises(ValueError, match="known where sigma is given"):
        smooth(t, y, noise="known")


def test_noisier_samples_count_for_less():
    t, rng = np.arange(300) / RATE, np.random.default_rng(6)
    sigma = np.where(np.arange(300) % 2, 0.01, 0.2)
    y = pluck(t)[:, 0] + rng.normal(0, 1, 300) * sigma
    weighted, plain = (smooth(t, y, s).state[10:-10, 0] - pluck(t)[10:-10, 0] for s in (sigma, None))
    assert weighted.std() < 0.3 * plain.std()


def test_a_gap_is_not_bridged():
    t = np.arange(200) / RATE
    y = pluck(t)[:, 0]
    y[80:100] = np.nan
    smoothed = smooth(t, y)
    assert np.isnan(smoothed.state[80:100]).all()
    assert set(smoothed.piece[:80]) == {0}
    assert set(smoothed.piece[100:]) == {1}
    assert np.isnan(between(smoothed, t[80:99] + 0.01)).all()
    # What lies beyond the gap does not reach back over it.
    other = y.copy()
    other[100:] += 50
    assert np.allclose(smooth(t, other).state[:80], smoothed.state[:80], atol=1e-6)


def test_one_missing_sample_does_not_part_the_record():
    t = np.arange(200) / RATE
    y = pluck(t)[:, 0]
    y[90] = np.nan
    smoothed = smooth(t, y)
    assert np.isnan(smoothed.state[90]).all()
    assert set(smoothed.piece) == {0, -1}
    assert np.allclose(smooth(np.delete(t, 90), np.delete(y, 90)).state[:90], smoothed.state[:90])


def test_pieces_of_five_samples_tell_nothing():
    t = np.arange(30) / RATE
    good = np.ones(30, bool)
    good[5:12] = False
    assert (pieces(t, good)[:5] == -1).all()
    assert (pieces(t, good)[12:] == 1).all()


def test_the_thesis_s_anomaly_carries_no_weight():
    """Figure 6.13: one frame's X slightly larger than it should have been."""
    t = np.arange(300) / RATE
    clean = pluck(t)[:, 0] + np.random.default_rng(7).normal(0, 0.02, 300)
    y = clean.copy()
    y[150] += 0.4
    smoothed = smooth(t, y)
    assert np.flatnonzero(smoothed.outlier).tolist() == [150]
    assert abs(smoothed.state[150, 0] - pluck(t)[150, 0]) < 0.05


def test_between_samples_the_spline_goes_on():
    t, fine = np.arange(300) / RATE, np.linspace(0.5, 9, 777)
    smoothed = smooth(t, pluck(t)[:, 0])
    for k in range(3):
        assert np.abs(between(smoothed, fine, k) - pluck(fine)[:, k]).max() < 1e-3 * 6**k
    assert np.isnan(between(smoothed, [-1.0, 11.0])).all()


def test_uneven_times_are_welcome():
    t = np.arange(300) / RATE + np.random.default_rng(8).uniform(0, 0.9 / RATE, 300)
    smoothed = smooth(t, pluck(t)[:, 0] + np.random.default_rng(9).normal(0, 0.02, 300))
    assert np.abs(smoothed.state[20:-20, 1] - pluck(t)[20:-20, 1]).max() < 1


def test_a_target_at_rest_has_no_outliers():
    smoothed = smooth(np.arange(50.0), np.full(50, 3.7))
    assert not smoothed.outlier.any()
    assert np.abs(smoothed.state[:, 1:]).max() < 1e-9


def test_times_must_rise():
    with pytest.raises(ValueError, match="must rise"):
        smooth([0, 1, 1, 2, 3, 4, 5], np.zeros(7))


def test_an_empty_record_is_smoothed_to_nothing():
    assert np.isnan(smooth(np.arange(10.0), np.full(10, np.nan)).state).all()


@given(st.integers(0, 2**32 - 1), st.floats(0.5, 2))
@settings(max_examples=20, deadline=None)
def test_a_limit_leaves_out_only_scores_beyond_it(seed, share):
    rng = np.random.default_rng(seed)
    t = np.arange(60) / 30
    piece = np.repeat([0, 1], [25, 35])
    y, weight = np.sin(3 * t) + rng.normal(0, 0.1, 60), np.ones(60)
    for plan in _Record(t, y, weight, piece, False).plans():
        wanted = _Record(t, y, weight, piece, False).score(plan)
        limited = _Record(t, y, weight, piece, False)
        limit = share * wanted
        assert limited.score(plan, limit) == (wanted if wanted <= limit else np.inf)
        assert limited.score(plan) == wanted
