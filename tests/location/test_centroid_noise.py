"""How noisy centroids are: from differences of errors, from few errors, or not at all."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.centroid_noise import Noise, _lowered, noise_factor
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
    assert each[:, :9] == pytest.approx(0.2, rel=0.2)
    assert noise_factor(cameras, b, sd, 1.0, relative=True).factor < 0.5


@pytest.mark.parametrize("n", [2, 3])
def test_a_camera_whose_sd_is_too_large_makes_that_of_no_other_camera_too_small(n):
    """As with a lamp that flickers before one of them: one factor for both made 0.29 of the sd of the other."""
    cameras, b, sd = sights(n, 300, 0.02)
    sd[0], sd[1:] = 0.3, 0.02
    found = noise_factor(cameras, b, sd, 0.1)
    assert (found.each[1:] > 0.9).all()
    assert 0.017 < found.each[0] * 0.3 < 0.03


@pytest.mark.parametrize("n", [2, 3, 4])
def test_cameras_that_are_as_much_too_careful_are_made_as_much_smaller(n):
    """Each alone may have made all errors; taken so, the sd of two cameras stayed 1.4 times too large."""
    cameras, b, sd = sights(n, 300, 0.2)
    assert noise_factor(cameras, b, sd, 1.0).each == pytest.approx(0.2, rel=0.15)


def test_each_of_three_cameras_whose_noise_is_seen_gets_its_own_factor():
    """Two have one error between them: of the one that is said to be better nothing is taken."""
    rng, true = np.random.default_rng(3), np.array([0.02, 0.02, 0.5])
    cameras, b, sd = sights(3, 300, 0.0)
    b = b + rng.normal(0, true[:, None, None, None], b.shape)
    sd = sd * np.array([0.1, 0.02, 1.0])[:, None, None, None]
    each = noise_factor(cameras, b, sd, 1.0).each[:, 0]
    assert each[0] < 0.3
    assert each[1] > 0.9
    assert each[2] == pytest.approx(0.5, rel=0.1)


def test_errors_in_which_a_camera_s_noise_is_not_seen_make_its_sd_no_smaller():
    """Its own are lost in those of a camera that is far worse."""
    said, seen = np.array([4.0, 1.0]), np.array([0.98, 0.98])
    parts = np.array([[0.98, 0.02], [0.98, 0.02]])
    assert _lowered(said, seen, parts) == pytest.approx([0.98, 1.0], abs=0.03)
    assert _lowered(np.array([np.nan, 1.0]), np.zeros(2), np.zeros((2, 2))).tolist() == [1.0, 1.0]


def test_a_camera_does_not_pay_for_the_chance_in_what_others_made_of_its_errors():
    """Its own half of them would be 0.06 if the other half were exactly as large as is said."""
    parts = np.array([[0.5, 0.5, 0.0], [0.05, 0.55, 0.4], [0.0, 0.5, 0.5]])
    said, seen = np.array([1.2, 1.0, 1.0]), np.array([0.56, 1.0, 1.0])
    assert _lowered(said, seen, parts, 0.0) == pytest.approx([0.12, 1.0, 1.0], abs=0.01)
    assert _lowered(said, seen, parts, 0.2) == pytest.approx([0.52, 1.0, 1.0], abs=0.01)


def test_what_changes_slowly_is_seen_too():
    """Second differences show nothing of it: as where a rope passes before a target, and its sd allows for that."""
    cameras, b, _ = sights(3, 300, 0.02)
    b[0] += 0.2 * np.sin(np.arange(300) / 30)[:, None]
    sd = np.full(b.shape, 0.02)
    sd[0] = 0.2
    assert (noise_factor(cameras, b, sd, 1.0).each > 0.65).all()


def test_an_sd_that_is_larger_for_a_reason_of_its_own_stays_larger():
    """A streak along its way: that the usual centroids are twice better than said does not make it better."""
    noise = Noise(0.5, "differences", np.array([[0.5], [2.0]]))
    sd = np.full((2, 1, 9, 2), 0.1)
    sd[:, :, 4, 0], sd[:, :, 5] = 0.5, np.nan
    scaled = noise.scaled(sd)
    assert scaled[0, 0, 0] == pytest.approx(0.05)
    assert scaled[0, 0, 4] == pytest.approx([0.49, 0.05], abs=0.01)
    assert np.isnan(scaled[:, :, 5]).all()
    assert scaled[1, 0, 4] == pytest.approx([1.0, 0.2])


def test_samples_whose_sd_is_right_keep_it_where_half_of_the_others_is_too_large():
    cameras, b, sd = sights(2, 300, 0.05)
    sd *= 0.05
    sd[:, :, 100:200] *= 20
    assert (noise_factor(cameras, b, sd, 0.1).each > 0.9).all()
