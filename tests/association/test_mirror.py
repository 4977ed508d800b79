"""A reflection is distinguished from a target by the plane between them and by the side that the cameras are on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.association.mirror import images_among, reflected

T = np.arange(120) / 30
EYES = np.array([[-60.0, -60.0, 50.0], [60.0, -60.0, 40.0]])


def ball(rng, noise=0.005):
    p = np.stack([4 * np.sin(2 * T), 3 * np.cos(1.3 * T), 6 + 2 * np.sin(5 * T)], -1)
    return p + rng.normal(0, noise, p.shape)


def in_water(p, rng, level=0.5, noise=0.005):
    q = p * (1, 1, -1) + (0, 0, 2 * level)
    return q + rng.normal(0, noise, q.shape)


def test_the_one_below_the_surface_is_the_image():
    rng = np.random.default_rng(0)
    p = ball(rng)
    assert reflected(p, in_water(p, rng), EYES) == 1
    assert reflected(in_water(p, rng), p, EYES) == 0


@given(st.integers(0, 1000))
def test_a_mirror_may_stand_anywhere_and_its_image_lies_beyond_it_as_the_cameras_see_it(seed):
    rng = np.random.default_rng(seed)
    p = ball(rng)
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    level = (p @ n).min() - 1.0
    q = p - 2 * ((p @ n) - level)[:, None] * n
    eyes = 30 * n + rng.uniform(-5, 5, (3, 3))
    if (p @ n).std() > 0.3:  # it moves towards the mirror and away
        assert reflected(p, q, eyes) == 1


def test_two_points_of_one_body_are_no_images_of_each_other():
    rng = np.random.default_rng(1)
    p = ball(rng)
    below = p - (0, 0, 5) + rng.normal(0, 0.005, p.shape)
    assert reflected(p, below, EYES) is None
    level = np.stack([4 * np.sin(2 * T), 3 * np.cos(T), np.full(T.size, 6.0)], -1)  # keeps its height
    assert reflected(level, level - (0, 0, 5), EYES) is None


def test_two_that_swing_against_each_other_are_no_images():
    rng = np.random.default_rng(2)
    p, q = ball(rng), ball(rng)
    q[:, 2] = 12 - q[:, 2]  # opposite in height, but elsewhere
    assert reflected(p + (3 * np.sin(3 * T)[:, None] * (1, 0, 0)), q, EYES) is None
    rising = np.stack([np.zeros(T.size), np.zeros(T.size), np.sin(3 * T)], -1)
    assert reflected(rising, -rising, EYES) is None  # through each other


def test_cameras_on_both_sides_and_few_common_moments_leave_it_open():
    rng = np.random.default_rng(3)
    p = ball(rng)
    q = in_water(p, rng)
    assert reflected(p, q, np.array([[0, 0, 50.0], [0, 0, -50.0]])) is None
    gaps = np.where(np.arange(T.size)[:, None] < 19, p, np.nan)
    assert reflected(gaps, q, EYES) is None


@pytest.mark.parametrize("waves", [0.02, 1.0])
def test_small_waves_on_the_surface_do_not_hide_the_image_and_large_ones_do(waves):
    rng = np.random.default_rng(4)
    p = ball(rng)
    q = in_water(p, rng) + waves * np.sin(7 * T)[:, None] * (0.3, 0.2, 1.0)
    assert (reflected(p, q, EYES) == 1) == (waves < 0.1)


def test_each_image_is_listed_with_its_target():
    rng = np.random.default_rng(5)
    p = ball(rng)
    q = p[::-1] * (1, -1, 1)
    places = [in_water(p, rng), p, q, in_water(q, rng)[20:]]
    moments = [np.arange(120), np.arange(120), np.arange(120), np.arange(20, 120)]
    assert images_among(moments, places, EYES) == {0: 1, 3: 2}
