"""What static clutter hides in part is found by what is to be seen of it, where that is a disc like the targets."""

import cv2
import numpy as np
import pytest

from tests.discs import disc
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import rough_blobs
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.recovery.beside_clutter import beside, discs_beside
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance

SHAPE = (60, 80)
DETECTION = Detection(noise=2.0)
NOTHING = np.zeros((0, 2)), np.zeros((0, 2))


def scene(x, y, radius=5.0, *, rope=slice(38, 41)):
    """A sample of a ball behind a rope, what stands out of the background, and the clutter."""
    rng = np.random.default_rng(1)
    ground = np.full(SHAPE, 30.0)
    ground[:, rope] = 150.0
    picture = 30 + 160 * disc(SHAPE, x, y, radius)
    picture[:, rope] = 150.0
    sample = Sample(np.clip(np.rint(picture + rng.normal(0, 2, SHAPE)), 0, 255).astype(np.uint8), 0.0)
    over = (sample.luma - ground > 40).astype(np.uint8)
    clutter = StaticClutter({0: cv2.integral((ground > 60).astype(np.uint8), sdepth=cv2.CV_32S)})
    return sample, rough_blobs(sample.luma, over, scale=1.0, min_pixels=4), clutter


def targets(radius=5.0):
    """The looks of a target of this radius and of one that has not been seen."""
    looks = np.array([np.pi * radius**2, 160.0, 30.0, 2 * radius, 2 * radius, 0.8, 1.0, 160.0])
    return Appearance(np.stack([looks, np.full(8, np.nan)], axis=1))


def found(x, y, radius=5.0, *, like=None, others=NOTHING):
    sample, blobs, clutter = scene(x, y, radius)
    which = np.flatnonzero(beside(clutter, sample, blobs))
    assert which.size
    return list(discs_beside(sample, blobs, which, clutter, like or targets(), others, DETECTION))


@pytest.mark.parametrize("x", [33.7, 36.2, 43.0])
def test_a_ball_behind_a_rope_is_found_once_where_it_is(x):
    ((place, looks),) = found(x, 30.3)
    assert np.abs(place - [x, 30.3]).max() < 0.25
    pixels, contrast, background, width, height = looks
    assert abs(np.log(pixels / (25 * np.pi))) < 0.15
    assert abs(np.log(width / height)) < 0.15
    assert abs(contrast / 160 - 1) < 0.1
    assert abs(background - 30) < 2


def test_what_is_no_disc_like_the_targets_is_not_found():
    assert not found(36.2, 30.3, 2.2)
    assert not found(36.2, 30.3, like=Appearance(np.full((8, 2), np.nan)))


def test_what_is_followed_already_is_not_found_again():
    assert not found(36.2, 30.3, others=(np.array([[36.0, 30.0]]), np.array([[10.0, 10.0]])))


def test_without_clutter_nothing_is_beside_it():
    sample, blobs, _ = scene(36.2, 30.3)
    assert not beside(None, sample, blobs).any()
