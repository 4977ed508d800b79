"""Free decay, against the exact solution, an independent integrator, and its own stated intervals."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vidtrack.analysis.decay import _decrement, free_decay, integrated, pooled

FIELD_RATE = 2 * 30000 / 1001


def released(rng, *, fn=0.9, zeta=0.03, b=0.0, start=24.0, rest=3.0, held_s=1.23, length_s=14.0, noise=0.01):
    t = 36000 + np.arange(0, length_s, 1 / FIELD_RATE)
    x = np.full(t.shape, start)
    moving = t > 36000 + held_s
    times = np.concatenate([[36000 + held_s], t[moving]])
    x[moving] = integrated(times, 2 * np.pi * fn, zeta, b, start, 0.0)[1:]
    return t, x + rest + rng.normal(0, noise, t.shape)


@pytest.mark.parametrize("b", [0.0, 0.02])
def test_the_solution_is_that_of_another_integrator(b):
    wn, zeta = 2 * np.pi * 0.7, 0.04
    t = np.linspace(0, 12, 300)
    other = solve_ivp(
        lambda _, s: [s[1], -2 * zeta * wn * s[1] - b * abs(s[1]) * s[1] - wn**2 * s[0]],
        (0, 12), [10.0, -3.0], t_eval=t, rtol=1e-10, atol=1e-10,
    ).y[0]  # fmt: skip
    assert integrated(t, wn, zeta, b, 10.0, -3.0) == pytest.approx(other, abs=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("slow", "least"), [(0.0, 0.945), (0.05, 0.93)])
def test_the_intervals_hold_the_truth_in_95_of_100_trials(slow, least):
    """White noise; and beside it noise that lasts over 41 samples, of which a record has some 14."""
    rng = np.random.default_rng(11)
    truth = {"fn": 0.9, "zeta": 0.03, "rest": 3.0}
    trials = []
    for _ in range(400):
        t, x = released(rng)
        x = x + np.convolve(rng.normal(0, slow, t.size + 40), np.ones(41) / 41, "valid")
        trials.append(free_decay(t, x, quadratic=False))
    inside = {
        k: np.mean([abs(getattr(d, k).value - v) <= getattr(d, k).half_width for d in trials]) for k, v in truth.items()
    }
    assert min(inside.values()) >= least - 0.02, inside
    assert least <= np.mean(list(inside.values())) < 0.98, inside


@pytest.mark.slow
def test_the_intervals_with_quadratic_damping_hold_the_truth():
    """Those of the fit, and those of the decrement of half cycles."""
    rng = np.random.default_rng(11)
    trials = [free_decay(*released(rng, b=0.01)) for _ in range(40)]
    truth = {"fn": 0.9, "zeta": 0.03, "b": 0.01, "rest": 3.0, "p": 0.03, "q": 0.01}
    inside = {
        k: sum(abs(getattr(d, k).value - v) <= getattr(d, k).half_width for d in trials) for k, v in truth.items()
    }
    assert min(inside.values()) >= 35, inside  # of 40 at 95 %: fewer in one of 70 counts
    assert sum(inside.values()) >= 228, inside


@pytest.mark.parametrize(("zeta", "b"), [(0.0, 0.01), (0.03, 0.01), (0.06, 0.01), (0.1, 0.0)])
def test_the_decrement_of_half_cycles_is_that_of_the_exact_motion(zeta, b):
    """To first order alone q would be 1 to 4 % too large."""
    t = np.arange(0, 14, 1 / 1000)
    x = integrated(t, 2 * np.pi * 0.9, zeta, b, 24.0, 0.0)
    turn = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    fits = [np.polyfit(t[k - 3 : k + 4] - t[k], x[k - 3 : k + 4], 2) for k in turn[1:17]]
    peaks = np.array([c0 - c1**2 / (4 * c2) for c2, c1, c0 in fits])
    _, p, q = _decrement(np.arange(16.0), peaks)
    assert p.value == pytest.approx(zeta, abs=2e-5)
    assert q.value == pytest.approx(b, abs=2e-5)


def test_the_decrement_of_half_cycles_agrees_with_the_fit():
    d = free_decay(*released(np.random.default_rng(3), b=0.01))
    assert d.p.value == pytest.approx(d.zeta.value, abs=0.001)
    assert d.q.value == pytest.approx(d.b.value, rel=0.03)


def test_the_release_is_found_to_a_tenth_of_a_sample():
    d = free_decay(*released(np.random.default_rng(5), held_s=2.0))
    assert d.release - 36002.0 == pytest.approx(0.0, abs=0.002)


def test_a_record_that_begins_within_the_motion_has_no_release_and_the_same_period():
    t, x = released(np.random.default_rng(5))
    d = free_decay(t[200:], x[200:])
    assert np.isnan(d.release)
    assert abs(d.fn.value - 0.9) < 2 * d.fn.half_width


def test_missing_samples_are_left_out():
    t, x = released(np.random.default_rng(6))
    x[200:230] = np.nan
    d = free_decay(t, x)
    assert abs(d.zeta.value - 0.03) < 2 * d.zeta.half_width
    assert not d.used[200:230].any()
    assert np.isnan(d.fitted[200:230]).all()


def test_correlated_residuals_widen_the_interval():
    rng = np.random.default_rng(8)
    t, x = released(rng)
    slow = np.convolve(rng.normal(0, 0.05, t.size + 40), np.ones(41) / 41, "valid")
    assert free_decay(t, x + slow).zeta.half_width > 2 * free_decay(t, x).zeta.half_width


@pytest.mark.parametrize(
    ("x", "why"),
    [
        (np.zeros(10), "fewer than 20"),
        (np.linspace(0, 1, 400), "half cycles"),
        (np.exp(-np.linspace(0, 20, 400)), "half cycles"),
    ],
)
def test_what_does_not_swing_is_refused(x, why):
    with pytest.raises(ValueError, match=why):
        free_decay(np.arange(len(x)) / 60, x)


def test_repeats_that_scatter_more_than_they_say_widen_the_pooled_interval():
    alike = pooled([(0.05, 0.001), (0.0501, 0.001), (0.0499, 0.001)])
    apart = pooled([(0.05, 0.001), (0.06, 0.001), (0.04, 0.001)])
    assert alike.value == pytest.approx(0.05)
    assert alike.half_width == pytest.approx(0.001 / np.sqrt(3))
    assert apart.half_width > 4.3 * 0.01 / np.sqrt(3) * 0.9  # Student's t with two degrees of freedom
