"""How noisy centroids are: from differences of errors, from few errors, or not at all."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.centroid_noise import Noise, noise_factor
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
    found = noise_factor(*sights(3, 300, noise, offset=0.5), 0.1)
    assert found.factor == pytest.approx(noise, rel=0.1)
    assert found.source == "differences"


def test_few_samples_give_their_errors_which_are_never_too_small():
    cameras, b, sd = sights(4, 3, 0.4)
    found = noise_factor(cameras, b, sd, 0.1)
    assert found.source == "errors"
    assert 0.2 < found.factor < 0.8
    assert noise_factor(cameras, b, sd, 5.0).factor == 5.0


def test_one_sample_of_two_cameras_gives_what_is_assumed():
    assert noise_factor(*sights(2, 1, 0.4), 0.1) == Noise(0.1, "none")


def test_centroids_better_than_their_sd_make_those_of_no_other_target_too_small():
    """Nine of ten targets are five times better than their sd says: the sigma of the tenth was a third of its error."""
    cameras, b, sd = sights(3, 300, 0.2)
    _, worse, _ = sights(3, 300, 1.0)
    b = np.concatenate([b] * 9 + [worse], axis=1)
    sd = np.ones(b.shape)
    assert noise_factor(cameras, b, sd, 1.0).factor > 0.65  # the mean of all says 0.37
    assert noise_factor(cameras, b[:, :9], sd[:, :9], 1.0).factor == pytest.approx(0.2, rel=0.15)
    assert noise_factor(cameras, b, sd, 1.0, relative=True).factor < 0.5
