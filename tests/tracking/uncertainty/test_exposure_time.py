"""Streaks say how long the exposure was, and where it is longer than any that each picture is a mean of several."""

import numpy as np
import pytest

from vidtrack.tracking.uncertainty.exposure_time import UNSEEN, exposure_of, lateness

K = 300
TIME = np.arange(K, dtype=float)


def swing(across=40.0, along=25.0, w=0.13):
    return np.stack([across * np.sin(w * TIME), along * np.cos(0.77 * w * TIME)])


def shown(place, exposure=0.0, pictures=1, own=None, lines=1, seed=3, noise=0.05):
    """The exposure of a target at places (2, K), seen in means of several pictures; own (2, 2, K): its own moments."""
    rng = np.random.default_rng(seed)
    exact = np.stack([np.gradient(one) for one in place])
    square = exposure**2 + pictures**2 - 1
    M = 9.0 * np.eye(2)[..., None] if own is None else own
    M = M + square / 12 * exact[:, None] * exact[None]
    second = np.stack([M[0, 0], M[1, 1], M[0, 1]]) + rng.normal(0, noise, (3, K))
    seen = place + rng.normal(0, 0.02, place.shape)
    velocity, acceleration = np.full((2, 2, K), np.nan)
    velocity[:, 1:-1] = (seen[:, 2:] - seen[:, :-2]) / 2
    acceleration[:, 1:-1] = seen[:, 2:] - 2 * seen[:, 1:-1] + seen[:, :-2]
    one = np.ones((K, 1), bool)
    return exposure_of(second[..., None], velocity[..., None], acceleration[..., None], one, lines)


@pytest.mark.parametrize("exposure", [0.5, 0.9, 1.0])
def test_an_exposure_is_found_and_is_no_mean_of_pictures(exposure):
    found = shown(swing(), exposure)
    assert np.sqrt(found.square) == pytest.approx(exposure, rel=0.05)
    assert (found.drawn, found.late) == (0.0, 0.0)


@pytest.mark.parametrize("exposure", [0.0, 0.4])
@pytest.mark.parametrize("pictures", [2, 3, 5])
def test_a_mean_of_pictures_is_late_by_half_of_them(pictures, exposure):
    found = shown(swing(), exposure, pictures)
    assert found.square == 0
    assert found.late == pytest.approx((pictures - 1) / 2, rel=0.12)


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_a_mean_of_pictures_shows_among_shapes_that_scatter(seed):
    """What glows on is not longer in proportion to the square of the velocity."""
    assert shown(swing(), 0.0, 3, seed=seed, noise=12.0).drawn == pytest.approx(2.8, rel=0.1)


def test_what_does_not_move_says_nothing():
    assert shown(0.02 * swing(), 0.0, 3) == UNSEEN
    assert shown(np.zeros((2, K)), 0.0, 3) == UNSEEN


@pytest.mark.parametrize("w", [0.8, 1.0, 1.3])
def test_swings_so_fast_that_velocities_are_too_small_are_no_means_of_pictures(w):
    place = swing(8.0, 8.0, w)
    true = np.stack([8.0 * w * np.cos(w * TIME), -8.0 * 0.77 * w * np.sin(0.77 * w * TIME)])
    M = 9.0 * np.eye(2)[..., None] + (true[:, None] * true[None] - grad(place)) / 12  # an exposure of a whole sample
    assert shown(place, 1.0, own=M).drawn == 0


def grad(place):
    exact = np.stack([np.gradient(one) for one in place])
    return exact[:, None] * exact[None]


@pytest.mark.parametrize("hurry", [0.0, 0.6])
def test_something_long_that_swims_lengthwise_is_no_mean_of_pictures(hurry):
    way = np.cumsum(3.0 * (1 + hurry * np.sin(TIME / 7)))
    angle = 0.012 * way
    place = np.stack([np.cumsum(np.cos(angle) * np.gradient(way)), np.cumsum(np.sin(angle) * np.gradient(way))])
    direction = np.stack([np.cos(angle), np.sin(angle)])
    M = 4.0 * np.eye(2)[..., None] + 60.0 * direction[:, None] * direction[None]
    assert shown(place, own=M).drawn == 0


def test_a_field_may_be_exposed_for_two():
    assert shown(swing(), 1.9, lines=2) == UNSEEN
    assert shown(swing(), 1.9).drawn == pytest.approx(1.9, rel=0.05)


def test_the_middle_of_a_streak_is_late_by_what_the_acceleration_makes():
    place, exposure = swing(w=0.3), 0.9
    t = TIME[:, None] + exposure * ((np.arange(200) + 0.5) / 200 - 0.5)
    mean = np.stack([40 * np.sin(0.3 * t).mean(1), 25 * np.cos(0.77 * 0.3 * t).mean(1)])
    a = np.stack([-40 * 0.09 * np.sin(0.3 * TIME), -25 * (0.77 * 0.3) ** 2 * np.cos(0.77 * 0.3 * TIME)])
    late, sd = lateness(np.zeros_like(a), a, exposure)
    np.testing.assert_allclose(mean - place, late, atol=0.002)
    np.testing.assert_allclose(sd, 0.3 * np.abs(late))
