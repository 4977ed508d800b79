"""Every blob of a piece of a picture, and which of them can be a target."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import no_blobs
from vidtrack.tracking.detection.candidates import (
    GATE,
    blobs_near,
    blobs_of,
    contrast_of,
    levels_beside,
    levels_in_boxes,
    unlikeness,
    within,
)
from vidtrack.tracking.sample import Sample

DETECTION = Detection(noise=1.0)
SHAPE = (80, 120)


def square(top, left, side, *, level=30, light=230):
    image = np.full(SHAPE, level, np.uint8)
    image[top : top + side, left : left + side] = light
    return Sample(image, 0.0)


def test_a_square_of_pixels_has_the_levels_that_it_has_on_paper():
    sample = square(40, 50, 8)
    blobs = blobs_of(sample, DETECTION, 130.0)
    assert (blobs.left[0], blobs.top[0], blobs.width[0], blobs.height[0]) == (50, 40, 8, 8)
    assert contrast_of(blobs) == pytest.approx(200, abs=0.1)
    assert levels_beside(sample, blobs, np.array([0]), DETECTION)[:, 0].tolist() == [30, 230]
    half = levels_in_boxes(sample, np.array([[40.0, 30.0, 30.0, 30.0]]), np.array([64.0]), DETECTION)
    assert half.tolist() == [130]


def test_dark_targets_have_the_levels_of_pictures_turned_bright():
    sample = square(40, 50, 8, level=225, light=25)
    dark = Detection(noise=1.0, dark=True)
    blobs = blobs_near(sample, dark, np.array([[40.0, 30.0, 30.0, 30.0]]), np.array([130.0]))
    assert np.abs([blobs.Xf[0] - 53.5, blobs.Yf[0] - 43.5]).max() < 1e-3
    assert levels_beside(sample, blobs, np.array([0]), dark)[:, 0].tolist() == [30, 230]


def test_only_blobs_that_lie_wholly_in_a_box_are_found_near():
    sample = Sample(picture(SHAPE, [(40.2, 40.0, 4.0), (57.0, 40.0, 4.0), (1.0, 40.0, 4.0)]), 0.0)
    boxes = np.array([[25.0, 25.0, 30.0, 30.0], [-10.0, 30.0, 20.0, 20.0]])
    near = blobs_near(sample, DETECTION, boxes, np.array([130.0, 130.0]))
    assert near.Xf.size == 2
    assert abs(near.Xf[0] - 40.2) < 0.02
    assert near.edge.tolist() == [False, True], "the edge is that of the picture, not of the box"
    outside = np.array([[200.0, 25.0, 30.0, 30.0]])
    assert blobs_near(sample, DETECTION, outside, np.array([130.0])).Xf.size == 0


def test_a_level_is_out_of_reach_where_nothing_stands_out_of_the_noise():
    noise = picture(SHAPE, [], noise=1.0, rng=np.random.default_rng(0))
    box = np.array([[40.0, 30.0, 30.0, 30.0]])
    assert levels_in_boxes(Sample(noise, 0.0), box, np.array([50.0]), DETECTION).tolist() == [GATE.unreachable]


def test_a_level_is_out_of_reach_in_a_box_that_shows_too_little_background():
    box = np.array([[48.0, 38.0, 10.0, 10.0]])
    assert levels_in_boxes(square(40, 50, 6), box, np.array([36.0]), DETECTION).tolist() == [GATE.unreachable]


def blobs_like(pixels, contrast):
    pixels = np.asarray(pixels)
    return no_blobs()._replace(pixels=pixels, mass=pixels * np.asarray(contrast, float))


@given(st.floats(20, 5000), st.floats(10, 250), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_how_unlike_two_things_are_does_not_depend_on_which_is_the_target(pixels, contrast, larger, lighter):
    other, light = pixels * np.exp(larger), contrast * np.exp(lighter)
    one_way = unlikeness(blobs_like([other], [light]), np.array([pixels]), np.array([contrast]))[0, 0]
    if abs(larger) < 0.9 and abs(lighter) < 0.9:
        assert one_way == pytest.approx(abs(larger) + abs(lighter))
        back = unlikeness(blobs_like([pixels], [contrast]), np.array([other]), np.array([light]))[0, 0]
        assert back == pytest.approx(one_way)
    elif abs(lighter) > 0.91 or abs(larger) > 0.91 + 3 / pixels:
        assert np.isinf(one_way)


def test_what_a_target_of_unknown_looks_is_like_is_anything():
    assert unlikeness(blobs_like([50, 900], [200, 20]), np.array([np.nan]), np.array([np.nan])).tolist() == [[0, 0]]


def test_positions_in_a_field_lie_in_boxes_that_are_twice_as_high_as_their_rows():
    box = no_blobs()._replace(left=np.array([10]), top=np.array([20]), width=np.array([8]), height=np.array([5]))
    at = np.array([[14.0, 28.0], [14.0, 31.0], [14.0, 24.0], [19.0, 24.0]])
    assert within(box, at, 2, slack=0.0)[:, 0].tolist() == [True, False, True, False]
    assert within(box, at, 1, slack=0.0)[:, 0].tolist() == [False, False, True, False]
