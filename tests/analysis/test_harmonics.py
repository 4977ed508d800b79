"""Harmonics of regular records and the response to a wave, against what was put in."""

import numpy as np
import pytest

from vidtrack.analysis.harmonics import beyond_zero, fit_harmonics, fundamental_frequency, phase_average, response
from vidtrack.analysis.interval import Estimate

F = 0.8


def wave_and_motion(rng, noise=0.02):
    t = 5000 + np.arange(0, 20, 1 / 60)
    own = t - 5000
    wave = 2 * np.cos(2 * np.pi * F * own - 0.4) + 0.1 * np.cos(4 * np.pi * F * own)
    motion = 0.5 + 3 * np.cos(2 * np.pi * F * own - 1.2) + 0.2 * np.cos(6 * np.pi * F * own - 0.3)
    return t, wave + rng.normal(0, noise, t.size), motion + rng.normal(0, noise, t.size)


def test_amplitudes_phases_and_mean_are_those_put_in():
    t, _, motion = wave_and_motion(np.random.default_rng(0), noise=0.0)
    found = fit_harmonics(t, motion, F, t0=5000)
    assert [a.value for a in found.amplitude] == pytest.approx([3, 0, 0.2], abs=1e-9)
    assert found.phase_deg[0].value == pytest.approx(np.degrees(1.2))
    assert found.mean.value == pytest.approx(0.5)
    assert found.periods == 16
    assert found.samples_a_period == pytest.approx(75)


def test_ratio_and_lag_lie_inside_their_intervals_in_about_95_of_100_trials():
    rng = np.random.default_rng(4)
    inside = np.zeros(3)
    for _ in range(60):
        t, wave, motion = wave_and_motion(rng)
        motion[100:150] = np.nan
        f = fundamental_frequency(t, wave)
        found = response(fit_harmonics(t, wave, f.value), fit_harmonics(t, motion, f.value))
        inside += [
            abs(f.value - F) < f.half_width,
            abs(found.ratio.value - 1.5) < found.ratio.half_width,
            abs(found.phase_deg.value - np.degrees(0.8)) < found.phase_deg.half_width,
        ]
    assert (inside >= 52).all()  # of 60 at 95 %: fewer in one of 300 series
    assert (inside < 60).any() or found.ratio.half_width < 0.01


def test_the_frequency_is_found_far_finer_than_the_lines_of_a_spectrum():
    t, wave, _ = wave_and_motion(np.random.default_rng(1))
    assert fundamental_frequency(t, wave).value == pytest.approx(F, abs=2e-5)  # lines are 0.05 Hz apart


def test_a_second_harmonic_is_measured_against_the_crest_of_the_fundamental():
    t = np.arange(0, 20, 1 / 100)
    wave = np.cos(2 * np.pi * F * t - 0.7)
    motion = 0.3 * np.cos(2 * (2 * np.pi * F * t - 0.7) - 0.5)
    found = response(fit_harmonics(t, wave, F), fit_harmonics(t, motion, F), harmonic=2)
    assert found.ratio.value == pytest.approx(0.3)
    assert found.phase_deg.value == pytest.approx(np.degrees(0.5))


def test_cycles_that_grow_are_unsteady():
    t = np.arange(0, 20, 1 / 60)
    steady = fit_harmonics(t, np.cos(2 * np.pi * F * t), F)
    grows = fit_harmonics(t, (1 + t / 20) * np.cos(2 * np.pi * F * t), F)
    assert steady.steadiness < 1e-9
    assert grows.steadiness == pytest.approx(0.5 / 1.5 / np.sqrt(3), rel=0.15)  # uniform between 1 and 2


def test_the_mean_cycle_is_the_cycle():
    t, wave, _ = wave_and_motion(np.random.default_rng(2))
    phase, mean, sd = phase_average(t, wave, F, t0=5000)
    own = 2 * np.cos(2 * np.pi * phase - 0.4) + 0.1 * np.cos(4 * np.pi * phase)
    assert mean == pytest.approx(own, abs=0.08)
    assert np.nanmedian(sd) < 0.1


def test_samples_that_keep_step_with_the_wave_lie_on_the_cycle_and_not_beside_it():
    t = np.arange(0, 20, 1 / (30 * F))  # 30 samples a period for 50 bins
    phase, mean, _ = phase_average(t + 0.004, np.cos(2 * np.pi * F * (t + 0.004)), F)
    seen = np.isfinite(mean)
    assert seen.sum() == 30
    assert mean[seen] == pytest.approx(np.cos(2 * np.pi * phase[seen]), abs=1e-9)


def test_less_than_two_periods_are_refused():
    t = np.arange(0, 1, 1 / 60)
    with pytest.raises(ValueError, match="at least 2"):
        fit_harmonics(t, np.cos(t), 1.5)


def test_of_noise_alone_the_amplitude_s_interval_holds_zero_in_95_of_100_records_and_the_phase_is_open():
    rng = np.random.default_rng(8)
    t = np.arange(0, 10, 0.05)
    found = [fit_harmonics(t, rng.normal(size=t.size), 1.0, n_harmonics=1) for _ in range(200)]
    held = [own.amplitude[0].value <= own.amplitude[0].half_width for own in found]
    assert 180 <= sum(held) <= 199  # 190, three standard deviations
    assert all((own.phase_deg[0].half_width == 180) == h for own, h in zip(found, held, strict=True))


def test_a_clear_amplitude_keeps_its_interval():
    size, lag = Estimate(1.0, 0.1), Estimate(30.0, 5.0)
    assert beyond_zero(size, lag) == (size, lag)
    assert beyond_zero(Estimate(0.1, 0.1), lag) == (Estimate(0.1, 0.1 * 2.4477 / 1.96), Estimate(30.0, 180.0))
