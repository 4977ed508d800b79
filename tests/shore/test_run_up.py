"""Run-up as it is quoted, of records whose set-up and swash were put in."""

import numpy as np
import pytest

from vidtrack.shore.run_up import run_up

T = np.arange(0, 600, 0.1)


def swash(incident=0.8, infragravity=0.3, setup=0.4):
    high = incident / 4 * np.sqrt(2) * np.sin(2 * np.pi * 0.1 * T)
    return setup + high + infragravity / 4 * np.sqrt(2) * np.sin(2 * np.pi * 0.01 * T)


def test_setup_and_the_parts_of_the_swash_are_those_put_in():
    found = run_up(T, 2.0 + swash(), still=2.0)
    assert found.setup == pytest.approx(0.4, abs=1e-3)
    assert (found.Sinc, found.Sig) == pytest.approx((0.8, 0.3), rel=0.01)
    assert found.S == pytest.approx(np.hypot(0.8, 0.3), rel=0.01)
    assert np.hypot(found.Sinc, found.Sig) == pytest.approx(found.S, rel=1e-3)


def test_a_regular_run_up_exceeds_its_crest_at_every_wave():
    found = run_up(T, swash(infragravity=0.0))
    assert found.R2 == pytest.approx(0.4 + 0.2 * np.sqrt(2), abs=1e-3)
    assert found.Rmax == pytest.approx(found.R2, abs=1e-3)
    assert found.Tz == pytest.approx(10, abs=1e-3)
    assert found.n in (58, 59)


def test_r2_of_a_gaussian_swash_is_that_of_rayleigh_maxima():
    """Maxima of a narrow Gaussian record are Rayleigh distributed: 2 % exceed sd sqrt(2 ln 50)."""
    rng = np.random.default_rng(3)
    f, phase = rng.normal(0.2, 0.01, 300), rng.uniform(0, 2 * np.pi, 300)
    t = np.arange(0, 20000, 0.5)
    z = sum(np.cos(2 * np.pi * a * t + b) for a, b in zip(f, phase, strict=True))
    assert run_up(t, z).R2 == pytest.approx(z.std() * np.sqrt(2 * np.log(50)), rel=0.04)


def test_missing_samples_are_left_out_and_too_few_give_nothing():
    z = swash()
    z[100:200] = np.nan
    assert run_up(T, z).setup == pytest.approx(0.4, abs=0.02)
    nothing = run_up(T[:2], z[:2])
    assert np.isnan(nothing.S)
    assert nothing.n == 0
    assert np.isnan(run_up(T[:30], z[:30]).Sig)


@pytest.mark.parametrize(
    ("setup", "incident", "infragravity", "R2"),
    [  # py-wave-runup 0.1.12, models.Stockdon2006: Hs 4 m, Tp 11 s, slope 0.1, and 1.5 m, 8 s, 0.08
        (0.9621334076, 2.0617144449, 1.6493715560, 2.5420364540),
        (0.3427979511, 0.7345670379, 0.7345670379, 0.9642169543),
    ],
)
def test_swash_of_stockdons_parts_has_stockdons_r2(setup, incident, infragravity, R2):
    """The model's R2 is 1.1 times set-up and half the swash, fitted to beaches: a Gaussian swash has a tenth more."""
    rng = np.random.default_rng(5)
    t, z = np.arange(0, 20000, 0.5), 0.0
    for height, low, high in ((incident, 0.08, 0.12), (infragravity, 0.005, 0.03)):
        f, phase = rng.uniform(low, high, 60), rng.uniform(0, 2 * np.pi, 60)
        part = sum(np.cos(2 * np.pi * a * t + b) for a, b in zip(f, phase, strict=True))
        z = z + part * height / (4 * part.std())
    found = run_up(t, setup + z)
    assert (found.setup, found.Sinc, found.Sig) == pytest.approx((setup, incident, infragravity), rel=0.02)
    assert found.S == pytest.approx(np.hypot(incident, infragravity), rel=0.02)
    assert found.R2 == pytest.approx(R2, rel=0.15)
