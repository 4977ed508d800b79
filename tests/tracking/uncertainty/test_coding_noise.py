"""Errors as coders make them, put on motion that is known: does each sample's sd say how large they are?"""

import numpy as np
import pytest

from vidtrack.tracking.uncertainty.coding_noise import CODING_NOISE, others_with_level, with_coding_noise
from vidtrack.tracking.uncertainty.empirical_sd import DIFFERENCES, mass_sd, per_grey_level, scatter

MASS, PIXELS = 9000.0, 50.0
G = float(per_grey_level(np.array(MASS), np.array(PIXELS), 1))
"""px for one grey level of noise."""


def motion(k, n=4, speed=2.0):
    t = np.arange(k)[:, None] * speed / 15 + 2 * np.pi * np.arange(n) / n
    return np.stack([100 + 15 * np.cos(t), 100 + 15 * np.sin(t)])


def found(at, noise, *, light=3.0, copied=False, seed=5, lasting=None):
    """What is found of positions (2, k, n) beside backgrounds of `noise` (k, n) grey levels."""
    k, n = noise.shape
    sd = np.tile(noise * G, (2, 1, 1))
    mass, pixels, time = np.full((k, n), MASS), np.full((k, n), PIXELS), np.arange(k, dtype=float)
    mass = mass + light * mass_sd(np.full((k, n), G), mass, pixels, 1) * np.random.default_rng(seed).normal(size=(k, n))
    seen = scatter(at, sd, mass, pixels, time)
    if lasting is not None:
        seen = seen._replace(lasting=lasting)
    return sd, *with_coding_noise(at, sd, mass, pixels, time, seen, lines=1, copied=copied)


def white(k, n=4, seed=1):
    return np.random.default_rng(seed).normal(size=(2, k, n))


def smooth_here_and_there(k, n=4):
    """A background that a coder leaves 0.3 to 4 grey levels of noise, in stretches of 6 samples."""
    return np.exp(np.random.default_rng(2).uniform(np.log(0.3), np.log(4), (k // 6 + 1, n))).repeat(6, axis=0)[:k]


def test_a_background_that_a_coder_smoothed_says_nothing_of_the_errors():
    error = 10 * G * white(600)
    raw, sd, what = found(motion(600) + error, smooth_here_and_there(600))
    assert raw.max() > 10 * raw.min()
    assert (sd > 0.8 * 10 * G).all()
    assert np.mean(sd < 2 * 10 * G) > 0.99
    assert np.sqrt(np.mean((error / sd) ** 2)) == pytest.approx(1.0, abs=0.15)
    assert what.level == pytest.approx(np.full((2, 4), 10.0), rel=0.3)
    assert not what.seen.rough.any()


def test_such_a_background_makes_no_track_rough():
    """By their own sd they scatter many times as much as their light."""
    k = 600
    at, noise = motion(k) + 10 * G * white(k), smooth_here_and_there(k)
    sd = np.tile(noise * G, (2, 1, 1))
    mass = MASS + 10 * mass_sd(np.full((k, 4), G), np.full((k, 4), MASS), np.full((k, 4), PIXELS), 1) * white(k)[0] / 4
    light = mass, np.full((k, 4), PIXELS), np.arange(float(k))
    seen = scatter(at, sd, *light)
    seen = seen._replace(rough=np.ones(4, bool))
    _, what = with_coding_noise(at, sd, *light, seen, lines=1, copied=False)
    assert not what.seen.rough.any()
    walk = np.cumsum(3 * 10 * G * white(k, seed=8), axis=1)
    _, what = with_coding_noise(motion(k) + walk, sd, *light, seen, lines=1, copied=False)
    assert what.seen.rough.all()


def test_an_sd_that_explains_the_scatter_stays():
    noise = smooth_here_and_there(600)
    raw, sd, what = found(motion(600) + noise * G * white(600), noise, light=0.0)
    assert sd == pytest.approx(raw * what.seen.factor[:, None])
    assert what.seen.factor.max() < 1.15
    assert (what.level == 0).all()


def test_a_swing_that_dies_away_is_no_unevenness():
    """Its curvature is left in differences of a low order, where it is fast."""
    k = 240
    t = np.arange(k)[:, None] + np.zeros(4)
    swing = 60 * np.exp(-t / 60) * np.sin(0.45 * t + np.arange(4))
    error = 10 * G * white(k)
    _, sd, _ = found(np.stack([100 + swing, 100 + 0.5 * swing]) + error, np.full((k, 4), 5.0))
    fast, slow = sd[:, :60], sd[:, 120:]
    assert np.sqrt(np.mean(fast**2)) < 1.3 * np.sqrt(np.mean(slow**2))
    assert 0.6 < np.mean((error / sd) ** 2) < 1.1


def test_errors_that_pictures_copy_are_larger_than_their_differences():
    k, speed, error = 4000, 0.4, white(4000)
    like = np.exp(-speed / CODING_NOISE.copied_px)
    for i in range(1, k):
        error[:, i] = like * error[:, i - 1] + np.sqrt(1 - like**2) * error[:, i]
    at = motion(k, speed=speed) + 10 * G * error
    noise = np.ones((k, 4))
    _, sd, _ = found(at, noise, copied=True)
    assert np.median(sd) == pytest.approx(10 * G, rel=0.15)
    _, sd, _ = found(at, noise, copied=False)
    assert np.median(sd) < 0.75 * 10 * G


def test_what_moves_by_pixels_has_errors_of_its_own_in_every_picture():
    at, noise = motion(1000, speed=5.0) + 10 * G * white(1000), np.ones((1000, 4))
    sd = [found(at, noise, copied=copied, lasting=1.0)[1] for copied in (True, False)]
    assert np.median(sd[0] / sd[1]) == pytest.approx(1.0, abs=0.03)


def test_light_whose_errors_seem_to_last_a_little_counts_where_pictures_are_copied_alone():
    """Blocks of Motion JPEG do that; a still pattern beside the course does it by far more, and moves the middle."""
    at, noise = motion(400) + 10 * G * white(400), smooth_here_and_there(400)
    for copied, lasting, least, most in ((False, 1.4, 1.0, 1.001), (False, 6.0, 3.0, 4.0), (True, 1.4, 1.05, 1.4)):
        alone, lasts = (found(at, noise, copied=copied, lasting=by)[1] for by in (1.0, lasting))
        assert least <= np.median(lasts / alone) <= most


def test_a_sample_that_leaves_the_course_has_a_larger_sd_and_so_has_a_bad_stretch():
    error = 5 * G * white(400)
    error[:, 200, 1] = 50 * G
    error[:, :6, 2] *= 8
    _, sd, _ = found(motion(400) + error, np.ones((400, 4)))
    assert (sd[:, 200, 1] > 2.5 * 5 * G).all()
    assert (sd[:, :6, 2] > 2 * 5 * G).all()
    assert np.median(sd[..., 3]) == pytest.approx(5 * G, rel=0.3)
    assert (sd <= 1.2 * CODING_NOISE.at_most * 5 * G).all()


def test_what_rests_has_the_level_of_what_moves():
    at = motion(400) + 10 * G * white(400)
    at[:, :, 3] = at[:, :1, 3]
    _, sd, what = found(at, smooth_here_and_there(400), copied=True)
    assert what.level[:, 3] == pytest.approx(DIFFERENCES.at_rest * np.median(what.level[:, :3], axis=1), rel=0.05)
    assert (sd[:, :, 3] > 0.7 * DIFFERENCES.at_rest * 10 * G).all()


def test_other_tracks_have_what_is_usual_of_the_targets():
    _, _, what = found(motion(600) + 10 * G * white(600), smooth_here_and_there(600))
    mass, pixels, sd = np.array([MASS, 2 * MASS]), np.full(2, PIXELS), np.full((2, 2), 0.1 * G)
    own = others_with_level(sd, mass, pixels, what, 1)
    assert own == pytest.approx(np.tile([10 * G, 5 * G], (2, 1)), rel=0.25)
    none = found(np.zeros((2, 50, 0)), np.ones((50, 0)))[2]
    assert (others_with_level(sd, mass, pixels, none, 1) == sd).all()


@pytest.mark.parametrize("k", [0, 1, 8])
def test_too_few_samples_change_nothing(k):
    raw, sd, what = found(motion(k) + 20 * G * white(k), np.ones((k, 4)), copied=True)
    assert sd == pytest.approx(raw)
    assert (what.level == 0).all()


def test_samples_that_are_missing_stay_so_and_cost_nothing():
    at = motion(600) + 10 * G * white(600)
    at[:, ::9] = np.nan
    _, sd, _ = found(at, np.ones((600, 4)), copied=True)
    assert np.isfinite(sd).all()
    assert np.median(sd) == pytest.approx(10 * G, rel=0.3)
