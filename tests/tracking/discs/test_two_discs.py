"""A blob that two discs explain: where each is, and what is not two."""

import numpy as np
import pytest
from scipy.special import ndtr

from tests.discs import disc
from vidtrack.tracking.discs.clump import clump_at, elongation
from vidtrack.tracking.discs.two_discs import TWO_DISCS, two_discs

SIZE, NOISE, LIGHT = 70, 2.0, 150.0
MIDDLE = 35.3


def window(share, noise=NOISE, seed=0):
    rng = np.random.default_rng(seed)
    return (30 + LIGHT * share + rng.normal(0, noise, share.shape)).astype(np.float32)


def union(apart, radius):
    """Two opaque discs so many radii apart on an oblique line; their middles (2, 2)."""
    step = apart * radius / 2 * np.array([0.8, 0.6])
    at = np.array([MIDDLE - step, MIDDLE + step])
    a, b = (disc((SIZE, SIZE), x, y, radius) for x, y in at)
    return 1 - (1 - a) * (1 - b), at


def two(*window, **lines):
    clump = clump_at(*window, **lines)
    return clump and two_discs(clump)


def found(share):
    grey = window(share)
    return two(grey, np.zeros(grey.shape, bool), MIDDLE, MIDDLE, LIGHT, NOISE)


def along():
    y, x = np.mgrid[:SIZE, :SIZE] - MIDDLE
    return 0.8 * x + 0.6 * y, 0.8 * y - 0.6 * x


@pytest.mark.parametrize(("radius", "apart"), [(4.0, 1.3), (8.0, 1.0), (8.0, 1.9), (14.0, 0.9)])
def test_two_that_overlap_are_found_each_in_its_place(radius, apart):
    share, at = union(apart, radius)
    pair = found(share)
    assert pair.measured
    off = np.linalg.norm(np.stack([pair.x, pair.y], 1)[:, None] - at, axis=-1)
    assert off.min(axis=1).max() < 0.1
    assert np.abs(np.exp(pair.shape[:2]) - radius).max() < 0.12 * radius


def test_two_that_overlap_by_most_of_a_diameter_are_two_but_not_measured():
    pair = found(union(0.55, 14.0)[0])
    assert pair is not None
    assert not pair.measured


def ellipse():
    u, v = along()
    return ndtr((1 - np.hypot(u / 16, v / 10)) * 12)


def rectangle():
    u, v = along()
    return ndtr(16 - np.abs(u)) * ndtr(9 - np.abs(v))


def streak():
    steps = np.linspace(-12, 12, 25)
    return np.mean([disc((SIZE, SIZE), MIDDLE + 0.8 * s, MIDDLE + 0.6 * s, 8.0) for s in steps], axis=0)


def half():
    u, _ = along()
    return disc((SIZE, SIZE), MIDDLE, MIDDLE, 12.0) * ndtr(u)


def behind_a_rope():
    u, _ = along()
    return disc((SIZE, SIZE), MIDDLE, MIDDLE, 12.0) * (1 - ndtr(1.5 - np.abs(u - 6)))


def alone():
    return disc((SIZE, SIZE), MIDDLE, MIDDLE, 10.0)


def with_glitter():
    return alone() + disc((SIZE, SIZE), MIDDLE + 9, MIDDLE + 3, 2.5)


@pytest.mark.parametrize("thing", [ellipse, rectangle, streak, half, behind_a_rope, alone, with_glitter])
def test_a_single_thing_is_not_two(thing):
    assert found(thing()) is None


@pytest.mark.parametrize("ratio", [0.8, 1.2])
def test_a_ball_in_pixels_that_are_not_square_is_one_though_its_noise_is_said_to_be_less_than_it_is(ratio):
    rng = np.random.default_rng(5)
    for seed in range(12):
        x, y = MIDDLE + rng.uniform(-0.5, 0.5, 2)
        grey = window(disc((SIZE, SIZE), x, y, 4.2, ratio=ratio), noise=3.0, seed=seed)
        assert two(grey, np.zeros(grey.shape, bool), MIDDLE, MIDDLE, LIGHT, 2.0) is None


def test_what_is_hidden_and_what_the_window_cuts_is_not_looked_at():
    share, _ = union(1.3, 8.0)
    grey = window(share)
    assert two(grey, np.ones(grey.shape, bool), MIDDLE, MIDDLE, LIGHT, NOISE) is None
    cut = grey[:, 30:]
    assert two(cut, np.zeros(cut.shape, bool), 8, MIDDLE, LIGHT, NOISE) is None


def test_in_a_field_discs_are_half_as_high():
    share, at = union(1.4, 10.0)
    grey = window(share[::2])
    pair = two(grey, np.zeros(grey.shape, bool), MIDDLE, MIDDLE / 2, LIGHT, NOISE, lines=2)
    off = np.linalg.norm(np.stack([pair.x, 2 * pair.y], 1)[:, None] - at, axis=-1)
    assert off.min(axis=1).max() < 0.2


def test_the_elongation_is_that_of_the_moments_whatever_the_direction():
    # a rectangle of 4 by 2: moments 16/12 and 4/12, so (16 - 4) / (16 + 4)
    assert elongation(np.array(16 / 12), np.array(4 / 12), np.array(0.0)) == pytest.approx(0.6)
    mean, half_difference = 10 / 12, 6 / 12
    turned = np.array([mean, mean, half_difference])
    assert elongation(*turned) == pytest.approx(0.6)
    assert TWO_DISCS.elongated < 0.6
