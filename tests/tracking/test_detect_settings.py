"""Detection speaks grey levels of targets that are brighter than the background, whatever the video's own."""

import numpy as np
import pytest

from vidtrack.tracking.detect_settings import Detection


def test_dark_targets_become_bright_and_twice_is_nothing():
    picture = np.array([[0, 10, 255]], np.uint8)
    dark = Detection(dark=True)
    np.testing.assert_array_equal(dark.bright(picture), [[255, 245, 0]])
    np.testing.assert_array_equal(dark.bright(dark.bright(picture)), picture)
    assert dark.bright(picture).dtype == np.uint8
    assert Detection().bright(picture) is picture


@pytest.mark.parametrize(("full", "stored"), [(1023, 600), (4095, 4000), (65535, 65535)])
def test_the_depth_of_the_picture_is_kept(full, stored):
    picture = np.array([[stored]], np.uint16)
    turned = Detection(dark=True, full=float(full), scale=255 / full).bright(picture)
    assert turned.dtype == np.uint16
    assert turned[0, 0] == full - stored


def test_a_threshold_by_hand_is_turned_with_the_picture():
    assert Detection().level is None
    assert Detection(dark=True).level is None
    assert Detection(threshold=90.0).level == 90.0
    assert Detection(threshold=90.0, dark=True).level == 165.0


def test_pixels_from_picture_to_picture_are_as_noisy_as_beside_each_other_unless_a_still_grain_is_known():
    assert Detection(noise=6.0).moving_noise == 6.0
    assert Detection(noise=6.0, flicker=1.5).moving_noise == 1.5
