"""Patches are chosen where texture runs both ways, and nowhere where there is only noise, an edge or a slope."""

import numpy as np
import pytest

from tests.steadiness.scenes import Wall
from vidtrack.steadiness.patches import chosen_patches, smooth, spread_over


@pytest.mark.parametrize("noise", [0.0, 1.0, 4.0, 10.0])
def test_noise_alone_has_no_texture(noise):
    rng = np.random.default_rng(1)
    one = 40 + rng.normal(0, noise, (240, 320))
    assert not len(chosen_patches(np.rint(one)))
    assert not len(chosen_patches(np.mean([np.rint(40 + rng.normal(0, noise, (240, 320))) for _ in range(8)], 0)))


def test_a_slope_of_light_and_straight_edges_have_no_texture():
    y, x = np.mgrid[0:240, 0:320].astype(float)
    assert not len(chosen_patches(30 + 0.3 * x + 0.2 * y))
    assert not len(chosen_patches(np.where(x > 160, 90.0, 30.0) + 0 * y))


def test_a_pattern_gives_patches_all_over_the_picture():
    wall = Wall(np.random.default_rng(2))
    middles = chosen_patches(wall.clean())
    assert len(middles) > 20
    assert spread_over(middles.astype(float), (320, 240)) == pytest.approx(0.29, abs=0.06)


def test_no_patch_covers_what_is_shut():
    wall = Wall(np.random.default_rng(3))
    shut = np.zeros((240, 320), bool)
    shut[60:180, 80:240] = True
    x, y = chosen_patches(wall.clean(), shut=shut).T
    assert len(x)
    assert not ((x > 80 - 14) & (x < 240 + 13) & (y > 60 - 14) & (y < 180 + 13)).any()


def test_a_picture_smaller_than_its_patches_has_none():
    assert chosen_patches(np.random.default_rng(0).normal(0, 50, (40, 40))).shape == (0, 2)


def test_blur_keeps_the_mean():
    assert smooth(np.full((30, 30), 7.0)) == pytest.approx(7.0)


def test_places_on_one_thing_are_not_spread():
    assert spread_over(np.array([[10.0, 10], [14, 12], [12, 11]]), (320, 240)) < 0.01
    assert spread_over(np.empty((0, 2)), (320, 240)) == 0
