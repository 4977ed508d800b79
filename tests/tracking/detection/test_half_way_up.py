"""A ball on a pattern is apart from it half-way up; a glint on a ball, or what goes on beyond the box, is no thing."""

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.candidates import blobs_near
from vidtrack.tracking.detection.half_way_up import things_in, with_half_way_up
from vidtrack.tracking.sample import Sample

DETECTION = Detection(noise=1.0)
BOX = np.array([[20.0, 20, 40, 40]])
LOW = 60.0


def strokes():
    """Strokes of 40 grey levels on a wall of 40: one across the whole picture, one alone."""
    ground = np.full((80, 80), 40.0)
    ground[38:41] = ground[26:30, 24:34] = 80.0
    return ground


def seen(ground, *balls, box=BOX, low=LOW, lines=1, detection=DETECTION):
    image = picture(np.shape(ground), balls, level=ground)
    luma = image[::lines]
    sample = Sample(luma, 0.0, 0, lines)
    near = blobs_near(sample, detection, box, np.array([low]))
    return near, with_half_way_up(near, sample, box, np.array([low]), detection)


def test_a_ball_across_a_stroke_is_seen_beside_the_stroke_that_lies_in_its_box():
    near, both = seen(strokes(), (40.0, 40.0, 6.0, 120.0))
    assert near.Xf.tolist() == pytest.approx([28.5])
    assert sorted(both.Xf.tolist()) == pytest.approx([28.5, 40.0], abs=0.1)
    ball = int(np.argmax(both.mass))
    assert both.Yf[ball] == pytest.approx(40.0, abs=0.1)
    assert both.pixels[ball] == pytest.approx(113, abs=8)


def test_of_a_field_as_well():
    near, both = seen(np.repeat(strokes()[::2], 2, axis=0), (40.0, 40.0, 6.0, 120.0), lines=2)
    assert near.Xf.size == 1
    ball = int(np.argmax(both.mass))
    assert (both.Xf[ball], both.Yf[ball]) == pytest.approx((40.0, 40.0), abs=0.3)


def test_what_a_ball_is_one_with_in_its_box_is_replaced_by_it():
    ground = np.full((80, 80), 40.0)
    ground[39:42, 40:55] = 90.0
    near, alone = seen(ground, (36.0, 40.0, 6.0, 120.0))
    assert near.Xf.size == alone.Xf.size == 1
    assert near.Xf[0] > 37
    assert alone.Xf[0] == pytest.approx(36.0, abs=0.5)


def test_a_glint_on_a_ball_is_no_thing():
    near, same = seen(np.full((80, 80), 40.0), (40.0, 40.0, 8.0, 60.0), (42.0, 38.0, 1.5, 120.0))
    assert near.Xf.size == same.Xf.size == 1
    assert same.pixels[0] == near.pixels[0]
    _, cut = seen(np.full((80, 80), 40.0), (40.0, 40.0, 30.0, 60.0), (42.0, 38.0, 1.5, 120.0))
    assert cut.Xf.size == 0


def test_what_goes_on_beyond_the_piece_is_no_thing_and_what_lies_in_it_is():
    piece = np.zeros((20, 20), np.uint8)
    piece[8:12, 8:12] = piece[3:6, :4] = 100
    piece[16:19, 2:9] = 30
    things = things_in(piece, (piece > 0).view(np.uint8), 0.0, 4)
    assert things.level == 50.0
    assert things.boxes.tolist() == [[8, 8, 4, 4]]
    assert not len(things_in(piece, (piece > 0).view(np.uint8), 0.0, 17).boxes)
    assert not len(things_in(piece, np.zeros_like(piece), 0.0, 4).boxes)


def test_a_threshold_of_the_user_and_an_empty_list_of_boxes_change_nothing():
    near, same = seen(strokes(), (40.0, 40.0, 6.0, 120.0), detection=Detection(noise=1.0, threshold=LOW))
    assert same is near
    sample = Sample(picture((80, 80), [], level=strokes()), 0.0)
    assert with_half_way_up(near, sample, np.zeros((0, 4)), [], DETECTION) is near


def test_a_box_that_leaves_the_picture_is_looked_at_as_far_as_it_lies_in_it():
    outside = np.array([[-60.0, 10, 40, 40]])
    _, none = seen(strokes(), (40.0, 40.0, 6.0, 120.0), box=outside)
    assert none.Xf.size == 0
    _, some = seen(strokes(), (40.0, 40.0, 6.0, 120.0), box=np.array([[30.0, 30, 90, 90]]))
    assert some.Xf[int(np.argmax(some.mass))] == pytest.approx(40.0, abs=0.1)
