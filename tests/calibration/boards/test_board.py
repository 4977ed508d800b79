"""The board's corners, and what bends and stretches it."""

import numpy as np
import pytest

from vidtrack.calibration.boards.board import SHAPE, Board


def test_corners_run_along_the_columns_from_the_upper_left_and_the_axes_are_right_handed():
    corners = Board("charuco", 5, 4, 10.0).corners
    assert len(corners) == 12
    np.testing.assert_allclose(corners[0], [10, 30, 0])
    np.testing.assert_allclose(corners[1], [20, 30, 0])
    np.testing.assert_allclose(corners[4], [10, 20, 0])


def test_circles_and_tags_lie_in_the_middle_of_their_squares():
    np.testing.assert_allclose(Board("circles", 4, 3, 10.0).corners[0], [5, 25, 0])
    tag = Board("apriltag", 4, 3, 10.0, marker=6.0).corners[:4]
    np.testing.assert_allclose(tag.mean(0), [5, 25, 0])
    np.testing.assert_allclose(tag[:2, 0], [2, 8])


@pytest.mark.parametrize("name", SHAPE)
def test_derivatives_are_those_of_the_shape(name):
    board = Board("charuco", 6, 5, 10.0)
    h = 1e-4
    plus, minus = (board.shaped({name: sign * h})[0] for sign in (1, -1))
    np.testing.assert_allclose((plus - minus) / (2 * h), board.shaped({})[1][name], atol=1e-9)


def test_a_flat_board_is_its_drawing():
    board = Board("checkerboard", 6, 5, 10.0)
    np.testing.assert_array_equal(board.shaped({})[0], board.corners)
