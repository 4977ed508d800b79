"""Errors that are known, put on motion that is known: by how much does their sd fall short?"""

import numpy as np
import pytest

from tests.discs import windows
from vidtrack.tracking.centroiding.centroid import measure
from vidtrack.tracking.centroiding.components import Windows, components
from vidtrack.tracking.uncertainty.empirical_sd import DIFFERENCES, scatter

SD, MASS, PIXELS = 0.01, 9000.0, 50.0
MASS_SD = SD * MASS * np.sqrt(4 * np.pi / (np.pi * (np.sqrt(PIXELS / np.pi) + 1.25) ** 2))
"""Grey levels: the scatter of the mass for the same noise, for a disc."""


def circles(k, n=4, radius=12.0, period=45.0):
    t = 2 * np.pi * (np.arange(k)[:, None] / period + np.arange(n) / n)
    return np.stack([100 + radius * np.cos(t), 100 + radius * np.sin(1.3 * t)])


def seen(motion, error, light=1.0, **settings):
    """scatter() of errors (2, k, n) px on a motion, the mass's scatter `light` times what the noise makes."""
    k, n = motion.shape[1:]
    mass = MASS + light * MASS_SD * np.random.default_rng(9).normal(size=(k, n))
    settings = {"time": np.arange(k, dtype=float)} | settings
    return scatter(motion + error, np.full((2, k, n), SD), mass, np.full((k, n), PIXELS), **settings)


def noise(k, n=4, seed=1):
    return SD * np.random.default_rng(seed).normal(size=(2, k, n))


def test_an_sd_that_is_right_stays_whatever_the_smooth_motion():
    found = seen(circles(900), noise(900))
    assert found.track == pytest.approx(np.ones((2, 4)), abs=0.12)  # 900 differences tell it to 4 %
    assert found.light == pytest.approx(np.ones(4), abs=0.12)
    assert found.factor.min() >= 1
    assert not found.rough.any()


def test_an_sd_that_falls_short_grows_by_as_much_along_each_axis():
    error = noise(900) * np.array([2.0, 3.0])[:, None, None]
    found = seen(circles(900), error, light=2.0)
    assert found.factor == pytest.approx(np.tile([[2.0], [3.0]], 4), rel=0.12)


def test_a_knock_is_no_noise():
    error = noise(900)
    error[:, 450:] += 5.0
    assert seen(circles(900), error).factor.max() < 1.3


def test_a_release_within_a_short_record_is_no_noise():
    """Drawn aside, let go after a second, then swinging with a wobble of 3 Hz: 240 samples at 30 a second."""
    t = np.arange(240)[:, None] / 30 - np.array([0.8, 0.9, 1.0, 1.1])
    swing = np.where(t > 0, np.cos(2 * np.pi * 0.97 * t), 1)
    wobble = np.where(t > 0, np.sin(2 * np.pi * 3.1 * t), 0)
    found = seen(np.stack([60 * swing + 1.5 * wobble, 5 * swing - 1.5 * wobble]), noise(240))
    assert found.factor.mean() < 1.2


def test_light_that_changes_with_the_motion_is_no_error_that_lasts():
    """Nearer and further, in and out of the lamp: 5 % of the mass in time with the motion."""
    t = 2 * np.pi * (np.arange(600)[:, None] / 20 + np.arange(4) / 4)
    mass = MASS * (1 + 0.05 * np.cos(t)) + MASS_SD * np.random.default_rng(9).normal(size=(600, 4))
    motion = np.stack([100 + 12 * np.cos(t), 100 + 12 * np.sin(t)])
    known = (np.full((2, 600, 4), SD), mass, np.full((600, 4), PIXELS), np.arange(600.0))
    assert scatter(motion + noise(600), *known).factor.mean() < 1.15


def test_motion_that_no_light_bears_out_is_told_and_does_not_count():
    walk = np.cumsum(np.random.default_rng(2).normal(0, 0.3, (2, 400, 4)), axis=1)
    found = seen(circles(400), noise(400) + walk)
    assert found.rough.all()
    assert found.track.min() > DIFFERENCES.position_to_light
    assert found.factor.max() < 1.3
    # the same scatter with as much of it in the light is noise
    borne_out = seen(circles(400), 15 * noise(400), light=10.0)
    assert not borne_out.rough.any()
    assert borne_out.factor == pytest.approx(np.full((2, 4), 15.0), rel=0.2)


def test_what_rests_and_is_copied_has_the_errors_of_what_moves():
    motion, error = circles(300), 6 * noise(300)
    motion[:, :, 2:] = motion[:, :1, 2:]
    error[:, :, 2:] = error[:, :1, 2:]
    found = seen(motion, error, light=3.0)
    assert found.track[:, 2:].max() < 1e-6
    assert found.factor[:, 2:] == pytest.approx(np.full((2, 2), DIFFERENCES.at_rest * 6), rel=0.2)
    alone = seen(motion[..., 2:], error[..., 2:])
    assert (alone.factor == 1).all()  # nothing tells


def test_errors_that_last_from_sample_to_sample_are_not_underrated():
    rng, lasting = np.random.default_rng(4), 0.6
    series = rng.normal(size=(3, 1000, 6))
    for k in range(1, 1000):
        series[:, k] = lasting * series[:, k - 1] + np.sqrt(1 - lasting**2) * series[:, k]
    motion, n = circles(1000, 6), 6
    mass = MASS + 3 * MASS_SD * series[2]
    sd, pixels = np.full((2, 1000, n), SD), np.full((1000, n), PIXELS)
    found = scatter(motion + 3 * SD * series[:2], sd, mass, pixels, np.arange(1000.0))
    assert np.median(found.factor) == pytest.approx(3.0, rel=0.2)
    assert found.factor.min() > 2.0  # differences of neighbours alone say 1.5


def test_a_gap_in_time_is_no_scatter():
    t = np.arange(300.0) + 0.3 * (np.arange(300) // 25)
    there = np.stack([3 * t, 2 * t])[:, :, None] + noise(300, 1)
    assert seen(there, 0.0, time=t).factor.max() < 1.3
    assert seen(there, 0.0).track.max() > 2  # as if no time had gone by


def test_a_bounce_is_no_scatter():
    t = np.arange(300.0)
    up = 40 - 0.6 * (t % 23 - 11.5) ** 2  # falls on and off again all 23 samples, at 14 px a sample
    there = np.stack([3 * t, up])[:, :, None] + noise(300, 1)
    assert seen(there, 0.0).factor == pytest.approx(np.ones((2, 1)), abs=0.2)


def test_too_few_samples_tell_nothing():
    for k in (0, 1, 8):
        found = seen(circles(k), 20 * noise(k))
        assert np.isnan(found.track).all()
        assert (found.factor == 1).all()


def test_samples_that_are_missing_do_not_count():
    error = noise(400)
    error[:, ::9] = np.nan
    assert seen(circles(400), error).factor == pytest.approx(np.ones((2, 4)), abs=0.25)


@pytest.mark.parametrize("radius", [2.5, 6.0])
def test_the_light_of_measured_discs_scatters_as_their_sd_foretells(radius):
    n = 400
    stack, truth = windows(n, radius, side=2 * int(radius) + 18, noise=5.0)
    zero = np.zeros(n, np.intp)
    view = Windows(stack, zero, zero, 1.0)
    found = components(view, 130.0)
    biggest = np.lexsort((-found.pixels, found.window))
    chosen = biggest[np.unique(found.window[biggest], return_index=True)[1]]
    c = measure(view, found, chosen, noise=5.0, threshold=130.0)
    error, sd = np.stack([c.x, c.y])[..., None] - truth.T[..., None], np.stack([c.sd_x, c.sd_y])[..., None]
    told = scatter(error, sd, c.mass[:, None], c.pixels[:, None].astype(float), np.arange(float(n)))
    assert told.track == pytest.approx(np.ones((2, 1)), abs=0.15)
    assert told.light == pytest.approx(np.ones(1), abs=0.3)  # the plane under it is foretold roughly


@pytest.mark.parametrize(("period", "most"), [(3.1, 1.4), (4.7, 1.4), (14.0, 6.5)])
def test_a_light_that_flickers_is_no_error_of_a_codec(period, most):
    """The sd of all targets was grown a hundredfold; 23 times by a slow flicker, which is like a still pattern."""
    k, n = 300, 4
    motion = circles(k)
    swing = 1 + 0.3 * np.sin(2 * np.pi * np.arange(k)[:, None] / period + np.arange(n))
    mass = MASS * swing + MASS_SD * np.random.default_rng(2).normal(size=(k, n))
    time = np.arange(k, dtype=float)
    found = scatter(motion + noise(k), np.full((2, k, n), SD), mass, np.full((k, n), PIXELS), time)
    assert found.factor.max() < most


def test_a_rate_that_varies_is_no_scatter():
    """A telephone's pictures come 25 to 42 ms apart, as the light wants; their times are known."""
    steps = np.random.default_rng(4).choice([0.75, 1.0, 1.0, 1.25, 2.0], 600)
    time = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    turn = 2 * np.pi * (time[:, None] / 45 + np.arange(4) / 4)
    motion = np.stack([100 + 12 * np.cos(turn), 100 + 12 * np.sin(1.3 * turn)])
    found = seen(motion, noise(600), time=time)
    assert not found.rough.any()
    assert found.track == pytest.approx(np.ones((2, 4)), abs=0.2)


def test_stamps_that_scatter_about_an_even_rate_hide_no_noise_and_make_none():
    time = np.arange(600) + np.random.default_rng(4).uniform(-0.1, 0.1, 600)
    found = seen(circles(600), noise(600) * 3, light=3.0, time=time)
    assert found.track == pytest.approx(np.full((2, 4), 3.0), rel=0.15)
