"""Pixels of a picture on the targets' side of the threshold, counted the plain way as well."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.pixel_counter import PixelCounter

EIGHT, TEN = Detection(), Detection(scale=255 / 1023, full=1023.0)


def dark(detection):
    return Detection(scale=detection.scale, full=detection.full, dark=True)


def test_a_pixel_at_the_level_itself_is_none_of_the_target():
    picture = np.array([[99, 100, 101, 102]], np.uint8)
    assert PixelCounter(EIGHT, 100.0).count(picture) == 2
    assert PixelCounter(EIGHT, 100.5).count(picture) == 2
    assert PixelCounter(dark(EIGHT), 155.0).count(picture) == 1
    assert PixelCounter(dark(EIGHT), 154.5).count(picture) == 2


@settings(max_examples=60)
@given(st.sampled_from([EIGHT, TEN]), st.booleans(), st.floats(1, 254), st.integers(0, 10))
def test_the_count_is_that_of_the_picture_turned_bright(detection, is_dark, level, seed):
    detection = dark(detection) if is_dark else detection
    dtype = np.uint8 if detection.full == 255 else np.uint16
    picture = np.random.default_rng(seed).integers(0, int(detection.full) + 1, (20, 30)).astype(dtype)
    expected = np.count_nonzero(detection.bright(picture) > level / detection.scale)
    assert PixelCounter(detection, level).count(picture) == expected


@pytest.mark.parametrize("shape", [(4, 6), (8, 3)])
def test_a_picture_of_another_shape_or_depth_is_counted_as_well(shape):
    counter = PixelCounter(EIGHT, 100.0)
    assert counter.count(np.full((5, 5), 200, np.uint8)) == 25
    assert counter.count(np.full(shape, 200, np.uint8)) == 24
    assert counter.count(np.zeros(shape, np.uint16)) == 0
    assert counter.count(np.full(shape, 200, np.uint16)) == 24
