"""The threshold of each target from what it looks like."""

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.target_threshold import target_levels
from vidtrack.tracking.detection.threshold import THRESHOLD
from vidtrack.tracking.state import Appearance


def looks(background, plateau):
    values = np.full((8, len(background)), np.nan)
    values[0], values[2], values[7] = 50, background, plateau
    return Appearance(values)


def test_each_target_has_the_level_half_way_up_its_own_peak():
    """The peak is that of a drawn disc; its plateau the mean of the pixels above the half."""
    image = picture((40, 40), [(20.2, 19.9, 4.0)], level=30, contrast=180).astype(float)
    plateau = image[image > 120].mean() - 30
    levels = target_levels(looks([30.0, 80.0], [plateau, plateau / 2]), Detection(noise=1.0), 100.0)
    assert levels == pytest.approx([120, 125], abs=5)


def test_no_level_lies_in_the_noise_of_the_background():
    levels = target_levels(looks([30.0], [2.0]), Detection(noise=3.0), 100.0)
    assert levels == pytest.approx([30 + SURROUNDINGS.stands_out * 3])


def test_a_target_that_has_not_been_seen_has_a_level_below_that_of_lone_pixels():
    levels = target_levels(looks([30.0, np.nan], [180.0, np.nan]), Detection(noise=2.0), 100.0)
    assert levels[1] == pytest.approx(100 - 2 * (THRESHOLD.sigmas - SURROUNDINGS.stands_out))
    assert levels[1] < 100
    assert np.isfinite(levels).all()


@pytest.mark.parametrize(("dark", "level"), [(False, 90.0), (True, 165.0)])
def test_the_threshold_of_the_user_is_that_of_every_target(dark, level):
    detection = Detection(threshold=90.0, dark=dark)
    assert target_levels(looks([30.0, np.nan], [180.0, np.nan]), detection, 100.0).tolist() == [level, level]
