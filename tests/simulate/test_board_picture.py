"""Boards are drawn where the camera sees them, through its lens."""

import cv2
import numpy as np
import pytest

from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.board_picture import board_picture, drawing

CAMERA = Camera(158.3, 121.2, 1, 1, 1.0, 330.0, -0.06 / 330**2, np.eye(3), np.zeros(3), (320, 240))
R = cv2.Rodrigues(np.array([0.3, -0.25, 0.1]))[0] @ np.diag([1, -1, -1.0])


def shown(kind, columns=7, rows=5, square=30.0, camera=CAMERA, R=R, distance=330.0, noise=1.0, **how):
    """The picture of a board and its pose."""
    middle = R @ np.array([columns, rows, 0]) * square / 2
    T = np.array([0.0, 0.0, distance]) - middle
    bitmap = drawing(kind, columns, rows)
    return board_picture(camera, R, T, bitmap, square, noise=noise, rng=np.random.default_rng(0), **how), T


@pytest.mark.parametrize("kind", ["charuco", "checkerboard", "circles", "apriltag"])
def test_corners_are_found_where_the_camera_puts_them(kind):
    """Within 0.12 px rms, of squares 24 px wide."""
    board = Board(kind, 7, 5, 30.0)
    picture, T = shown(kind)
    seen = board_seen(board, picture)
    assert seen is not None
    assert len(seen.ids) > 0.8 * len(board.corners)
    truth = project(CAMERA, board.corners[seen.ids] @ R.T + T)
    if kind in ("checkerboard", "circles"):  # alike upside down
        turned = project(CAMERA, board.corners[::-1][seen.ids] @ R.T + T)
        truth = min((truth, turned), key=lambda b: np.abs(b - seen.b).max())
    assert np.sqrt(((seen.b - truth) ** 2).mean()) < 0.12
    assert (seen.sd > 0).all()


def test_nothing_of_the_board_is_behind_the_camera():
    picture, _ = shown("charuco", distance=-400.0)
    assert abs(picture.mean() - 110) < 2
