"""How noisy centroids are: from differences of errors, from few errors, or not at all."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.sight_lines.centroid_noise import noise_factor
from vidtrack.simulate.rig import thesis_rig


def sights(n, T, noise, offset=0.0):
    rng = np.random.default_rng(1)
    cameras = thesis_rig(n)
    p = np.stack([10 * np.cos(np.arange(T) / 9), np.sin(np.arange(T) / 7), np.zeros(T)], -1)
    b = np.stack([project(c, p) + rng.normal(0, noise, (T, 2)) for c in cameras])
    b[0] += offset  # what a calibration leaves
    return cameras, b[:, None], np.ones((n, 1, T, 2))


@pytest.mark.parametrize("noise", [0.02, 0.1, 1.5])
def test_differences_show_the_noise_and_not_what_the_calibration_leaves(noise):
    found = noise_factor(*sights(3, 300, noise, offset=0.5), 0.1, relative=True)
    assert found.factor == pytest.approx(noise, rel=0.1)
    assert found.source == "differences"
    assert (found.each == found.factor).all()


def test_few_samples_give_their_errors_which_are_never_too_small():
    cameras, b, sd = sights(4, 3, 0.4)
    found = noise_factor(cameras, b, sd, 0.1)
    assert found.source == "errors"
    assert 0.2 < found.factor < 0.8
    assert noise_factor(cameras, b, sd, 5.0).factor == 5.0


def test_one_sample_of_two_cameras_gives_what_is_assumed():
    found = noise_factor(*sights(2, 1, 0.4), 0.1)
    assert (found.factor, found.source) == (0.1, "none")
    assert found.each.tolist() == [[0.1], [0.1]]


def test_centroids_better_than_their_sd_make_those_of_no_other_target_too_small():
    """Nine of ten targets are five times better than their sd says: the sigma of the tenth was a third of its error."""
    cameras, b, sd = sights(3, 300, 0.2)
    _, worse, _ = sights(3, 300, 1.0)
    b = np.concatenate([b] * 9 + [worse], axis=1)
    sd = np.ones(b.shape)
    each = noise_factor(cameras, b, sd, 1.0).each
    assert (each[:, 9] > 0.9).all()
    assert each[:, :9] == pytest.approx(0.3, rel=0.2)  # of three cameras each may have made most of the errors
    assert noise_factor(cameras, b, sd, 1.0, relative=True).factor < 0.5


@pytest.mark.parametrize("n", [2, 3])
def test_a_camera_whose_sd_is_too_large_makes_that_of_no_other_camera_too_small(n):
    """As with a lamp that flickers before one of them: one factor for both made 0.29 of the sd of the other."""
    cameras, b, sd = sights(n, 300, 0.02)
    sd[0], sd[1:] = 0.3, 0.02
    found = noise_factor(cameras, b, sd, 0.1)
    assert (found.each[1:] > 0.9).all()
    assert found.each[0] < 0.2
    assert found.each[0] * 0.3 > 0.02


@pytest.mark.parametrize("n", [2, 3, 4])
def test_no_sd_is_made_smaller_than_the_noise_is(n):
    cameras, b, sd = sights(n, 300, 0.2)
    each = noise_factor(cameras, b, sd, 1.0).each
    assert (each > 0.2).all()
    assert (each < 0.2 * {2: 1.8, 3: 1.7, 4: 1.5}[n]).all()


def test_samples_whose_sd_is_right_keep_it_where_half_of_the_others_is_too_large():
    cameras, b, sd = sights(2, 300, 0.05)
    sd *= 0.05
    sd[:, :, 100:200] *= 20
    assert (noise_factor(cameras, b, sd, 0.1).each > 0.9).all()


@pytest.mark.parametrize("n", [3, 4])
def test_an_error_that_lasts_keeps_the_sd_that_holds_it(n):
    """As behind a ball before a pattern, which is 2 sd off for a third of the run and is not seen to change there."""
    cameras, b, sd = sights(n, 300, 0.2)
    b[-1, :, 100:200] += (2.0, 1.0)
    found = noise_factor(cameras, b, sd, 1.0)
    assert found.whole[-1, 0] > 0.9
    assert found.each[-1, 0] < 0.5


def test_an_sd_that_holds_what_lasts_is_not_made_smaller_by_what_changes():
    """Of the outlines of lit balls: 0.33 px became 0.10, and middles were off by up to 0.6 px, samples on end."""
    cameras, b, sd = sights(3, 300, 0.02)
    sd *= 0.1
    found = noise_factor(cameras, b, sd, 1.0, alike=[True, False, False])
    assert found.each[0] == found.whole[0] == 1.0
    assert (found.whole[1:] < 0.5).all()


def test_of_two_cameras_whose_errors_show_one_direction_alone_no_sd_is_made_smaller():
    """As with streaks, whose sd is large along their way: where that is an epipolar line its errors are not seen."""
    cameras, b, sd = sights(2, 300, 0.2)
    found = noise_factor(cameras, b, sd, 1.0)
    assert (found.whole == 1.0).all()
    assert (found.each < 0.5).all()
