"""What axes show, and pictures beneath it."""

import base64

import cv2
import numpy as np
import pytest

from vidtrack.figures.drawing import LARGEST, Axes, grey_uri, new_drawing, picture_axes


def picture_of(uri):
    return cv2.imdecode(np.frombuffer(base64.b64decode(uri.split(",")[1]), np.uint8), cv2.IMREAD_UNCHANGED)


def test_limits_are_those_of_the_data_with_a_margin_and_an_end_that_is_asked_for_is_kept():
    ax = Axes()
    ax.around([0, 10], [1, 1], [2, 1], "red")
    assert ax.bounds()[0] == pytest.approx((-0.5, 10.5))
    assert ax.bounds()[1] == pytest.approx((-1.2, 3.2))
    ax.ylim = (0.0, float("nan"))
    assert ax.bounds()[1] == pytest.approx((0, 3.2))


def test_a_level_across_is_seen_and_an_upright_one_moves_no_limit_of_y():
    ax = Axes()
    ax.plot([0, 1], [0, 1], "red")
    ax.level(5.0)
    ax.level(0.5, upright=True)
    assert ax.bounds()[1] == pytest.approx((-0.25, 5.25))


def test_seconds_since_midnight_are_counted_from_a_whole_second_on():
    ax = Axes()
    ax.plot([36000.4, 36002.0], [0, 1], "red")
    ax.clock()
    assert (ax.xlabel, ax.x_first) == ("time (s after 10:00:00)", 36000.0)


def test_a_picture_keeps_its_greys_between_black_and_white_and_a_large_one_is_made_smaller():
    grey = np.array([[10, 20], [30, 50]], np.uint8)
    assert picture_of(grey_uri(grey, 10, 50)).tolist() == [[0, 63], [127, 255]]
    assert picture_of(grey_uri(np.zeros((400, 2 * LARGEST), np.uint8), 0, 1)).shape == (200, LARGEST)


def test_frame_buffer_axes_have_y_downward_and_pixel_0_at_the_top_left():
    drawing = new_drawing()
    (ax,) = drawing.axes
    picture_axes(ax, np.zeros((40, 60), np.uint8))
    assert (ax.xlim, ax.ylim, ax.y_down, ax.equal) == ((-0.5, 59.5), (-0.5, 39.5), True, "box")
