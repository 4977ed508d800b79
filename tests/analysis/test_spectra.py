"""Spectra, sea states and transfer functions, against what is known in closed form."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from vidtrack.analysis.interval import t_factor
from vidtrack.analysis.spectra import evenly, sea_state, single_waves, spectrum, transfer

STEP = 0.05


def irregular(rng, n=40_000):
    b, a = butter(2, [0.05 * 2 * STEP, 0.5 * 2 * STEP], "band")
    return lfilter(b, a, rng.normal(size=n))


def test_the_band_of_white_noise_holds_its_flat_density_in_about_95_of_100_lines():
    x = np.random.default_rng(0).normal(size=40_000)
    found = spectrum(STEP, x, resolution=0.05)
    inside = (found.low < 2 * STEP) & (2 * STEP < found.high)
    assert 0.92 < inside[2:-2].mean() < 0.98


def test_significant_height_is_four_standard_deviations():
    x = irregular(np.random.default_rng(1))
    assert sea_state(spectrum(STEP, x)).Hm0 == pytest.approx(4 * x.std(), rel=0.01)


def test_a_narrow_sea_has_one_period():
    t = np.arange(40_000) * STEP
    x = np.cos(2 * np.pi * 0.4 * t)
    found = sea_state(spectrum(STEP, x), f_min=0.3, f_max=0.5)
    assert [found.Tp, found.Tz, found.Te] == pytest.approx([2.5, 2.5, 2.5], rel=0.005)
    waves = single_waves(STEP, x)
    assert waves.Tz == pytest.approx(2.5, rel=1e-4)
    assert waves.H13 == pytest.approx(2.0, rel=1e-3)


def test_heights_of_a_narrow_gaussian_sea_are_rayleigh_distributed():
    """Longuet-Higgins (1952): H1/3 = 4.004 standard deviations."""
    rng = np.random.default_rng(2)
    t = np.arange(80_000) * STEP
    f = 0.4 + 0.01 * rng.normal(size=300)
    x = np.cos(2 * np.pi * np.outer(t, f) + rng.uniform(0, 2 * np.pi, 300)).sum(axis=1)
    assert single_waves(STEP, x).H13 / x.std() == pytest.approx(4.004, rel=0.03)


def test_standard_errors_of_a_response_are_honest():
    rng = np.random.default_rng(3)
    x = irregular(rng)
    y = 1.7 * np.roll(x, 4) + 0.05 * rng.normal(size=x.size)
    found = transfer(STEP, x, y)
    use = (found.f > 0.1) & (found.f < 0.4)
    lag = np.exp(-2j * np.pi * found.f[use] * 4 * STEP)
    z_ratio = (np.abs(found.H[use]) / 1.7 - 1) / found.sd_ratio[use]
    z_phase = np.angle(found.H[use] / lag) / found.sd_ratio[use]
    assert 0.75 < z_ratio.std() < 1.35
    assert 0.75 < z_phase.std() < 1.35


def test_bands_of_short_records_hold_the_response_in_95_of_100_lines():
    """Some 14 averages; a response that follows by a part of a segment is compared with the wave that made it."""
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(40):
        x = irregular(rng, 12_000)
        y = 1.7 * np.roll(x, 40) + 0.1 * x.std() * rng.normal(size=x.size)
        found = transfer(STEP, x[100:], y[100:])
        use = (found.f > 0.1) & (found.f < 0.4)
        off = found.H[use] / (1.7 * np.exp(-2j * np.pi * found.f[use] * 40 * STEP))
        band = t_factor(found.freedom) * found.sd_ratio[use]
        inside.append([np.abs(np.abs(off) - 1) < band, np.abs(np.angle(off)) < band])
    ratio, phase = np.concatenate(inside, axis=1).mean(axis=1)
    assert 0.94 < ratio < 0.97  # 840 lines
    assert 0.94 < phase < 0.97


def test_noise_in_the_response_does_not_raise_the_ratio():
    """The root of the ratio of the spectra would be 3 % too large here."""
    rng = np.random.default_rng(4)
    x = irregular(rng)
    y = x + irregular(rng) * 0.25
    found = transfer(STEP, x, y)
    use = (found.f > 0.1) & (found.f < 0.4)
    assert np.abs(found.H[use]).mean() == pytest.approx(1.0, abs=0.01)
    assert found.coherence[use].mean() == pytest.approx(1 / (1 + 0.25**2), abs=0.01)


def test_the_longest_stretch_without_a_gap_is_used():
    t = np.arange(1000) * STEP
    x = np.cos(t)
    x[300:320] = np.nan
    x[600] = np.nan
    step, found = evenly(t, x)
    assert step == pytest.approx(STEP)
    assert found.size == 680
    assert found[280] == pytest.approx(np.cos(t[600]), abs=0.001)
