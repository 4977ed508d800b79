"""What a picture shows of a board, and why it shows none."""

import numpy as np
import pytest

from tests.simulate.test_board_picture import shown
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen, corner_sd, why_not

CHARUCO, _ = shown("charuco")


def test_an_empty_picture_shows_no_board():
    grey = np.full((240, 320), 120, np.uint8)
    for kind in ("charuco", "checkerboard", "circles", "apriltag"):
        assert board_seen(Board(kind, 7, 5, 30.0), grey) is None
    assert why_not(Board("charuco", 7, 5, 30.0), grey) == ""


def test_a_mirrored_print_is_named():
    mirrored = np.ascontiguousarray(CHARUCO[:, ::-1])
    assert board_seen(Board("charuco", 7, 5, 30.0), mirrored) is None
    assert "mirrored" in why_not(Board("charuco", 7, 5, 30.0), mirrored)


def test_inner_corners_counted_for_squares_are_named_with_the_right_numbers():
    checkerboard, _ = shown("checkerboard")
    board = Board("checkerboard", 6, 4, 30.0)
    assert board_seen(Board("checkerboard", 7, 5, 30.0), checkerboard) is not None
    assert "7 x 5 squares" in why_not(board, checkerboard) or board_seen(board, checkerboard) is not None


def test_another_dictionary_is_named():
    line = why_not(Board("charuco", 7, 5, 30.0, dictionary="DICT_4X4_50"), CHARUCO)
    assert "DICT_5X5_250" in line


def test_noise_widens_the_standard_deviation_and_blur_too():
    at = np.array([[160.0, 120.0]])
    step = np.where(np.arange(320)[None] + np.arange(240)[:, None] > 280, 200, 40)
    corner = np.where((np.arange(320)[None] > 160) ^ (np.arange(240)[:, None] > 120), 200.0, 40.0)
    rng = np.random.default_rng(0)

    def sd(picture, noise):
        return corner_sd(np.clip(picture + rng.normal(0, noise, picture.shape), 0, 255).astype(np.uint8), at)[0]

    import cv2

    assert sd(corner, 8.0) > 2 * sd(corner, 2.0)
    assert sd(cv2.GaussianBlur(corner, (0, 0), 4.0), 2.0) > 1.5 * sd(corner, 2.0)
    assert sd(step, 2.0) > sd(corner, 2.0)


@pytest.mark.parametrize("kind", ["charuco", "apriltag"])
def test_a_board_that_is_partly_hidden_gives_the_corners_that_are_seen(kind):
    picture, _ = shown(kind)
    picture[:, :140] = 110
    seen = board_seen(Board(kind, 7, 5, 30.0), picture)
    whole = board_seen(Board(kind, 7, 5, 30.0), shown(kind)[0])
    assert 6 <= len(seen.ids) < len(whole.ids)
    assert set(seen.ids) <= set(whole.ids)
