"""Boards that look alike turned: one first corner for all cameras, or the word that it cannot be had."""

import cv2
import numpy as np
import pytest

from tests.calibration.boards.test_board_fit import cameras
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_turns import one_orientation, turns_of
from vidtrack.geometry.camera import project

NOISE = 0.1


def seen(board, m, n, seed, tilt=0.5):
    """Where m cameras see the corners (m, n, q, 2) px, each view named by any turn that looks alike, and the poses."""
    rng, q = np.random.default_rng(seed), len(board.corners)
    b, poses, names = np.full((m, n, q, 2), np.nan), [{} for _ in range(m)], np.zeros((m, n), int)
    turns = turns_of(board)
    for k in range(n):
        tilted = cv2.Rodrigues(rng.normal(0, tilt, 3) * [1, 1, 0])[0]
        R = tilted @ cv2.Rodrigues(np.array([0, 0, rng.uniform(0, 6) * (tilt > 0)]))[0] @ np.diag([1, -1, -1.0])
        T = rng.uniform([-50, -50, 600], [150, 50, 900]) if tilt else np.array([0.0, 0, 700])
        T = T - R @ board.corners.mean(0)
        for i, camera in enumerate(cameras(m)):
            names[i, k] = rng.integers(len(turns))
            rows, T_own = turns[names[i, k]]
            at = project(camera, board.corners @ R.T + T)
            b[i, k] = (at + rng.normal(0, NOISE, at.shape))[rows]
            pose = np.concatenate([camera.R @ R, (camera.R @ T + camera.T)[:, None]], -1)
            slip = cv2.Rodrigues(rng.normal(0, 1e-3, 3))[0]
            turned = np.concatenate([pose[:, :3] @ T_own[:, :3], (pose @ [*T_own[:, 3], 1])[:, None]], -1)
            poses[i][k] = np.concatenate([slip @ turned[:, :3], turned[:, 3:]], -1)
    return b, poses, names


@pytest.mark.parametrize(
    ("board", "alike"),
    [
        (Board("circles", 7, 5, 30.0), 2),
        (Board("circles", 6, 6, 30.0), 4),
        (Board("checkerboard", 8, 6, 30.0), 2),
        (Board("checkerboard", 7, 5, 30.0), 2),
        (Board("checkerboard", 7, 7, 30.0), 4),
        (Board("checkerboard", 6, 6, 30.0), 2),
        (Board("checkerboard", 8, 5, 30.0), 1),
        (Board("charuco", 8, 6, 30.0), 1),
    ],
)
def test_a_board_has_as_many_turns_as_leave_its_drawing_as_it_is(board, alike):
    from vidtrack.simulate.board_picture import drawing

    bitmap = drawing(board.type, board.columns, board.rows)
    quarters = [k for k in range(4) if np.rot90(bitmap, k).shape == bitmap.shape]
    same = [k for k in quarters if np.abs(np.rot90(bitmap, k).astype(int) - bitmap).mean() < 3]
    assert len(turns_of(board)) == len(same) == alike
    for rows, motion in turns_of(board):
        moved = board.corners @ motion[:, :3].T + motion[:, 3]
        np.testing.assert_allclose(moved, board.corners[rows], atol=1e-9)


@pytest.mark.parametrize("columns", [8, 7])
@pytest.mark.parametrize("seed", range(4))
def test_cameras_that_name_corners_differently_are_brought_to_one_naming(columns, seed):
    board = Board("circles", columns, 7, 30.0)
    b, poses, names = seen(board, 3, 5, seed)
    poses[2] = {k: poses[2][k] for k in (0, 1, 2)}  # the others see views that it does not
    found = one_orientation(board, b, np.ones(b.shape[:3]), poses)
    assert found.unsure == ()
    for k in range(5):
        for i in range(3):
            if k in poses[i]:
                rows = turns_of(board)[names[0, k]][0]
                back = np.argsort(turns_of(board)[names[i, k]][0])
                assert np.abs(found.b[i, k] - b[i, k][back][rows]).max() < 1e-9


def test_views_of_one_attitude_and_place_leave_the_turn_open():
    board = Board("checkerboard", 8, 6, 30.0)
    b, poses, _ = seen(board, 2, 4, 0, tilt=0)
    assert one_orientation(board, b, np.ones(b.shape[:3]), poses).unsure == (1,)
    b, poses, _ = seen(board, 2, 1, 0)
    assert one_orientation(board, b, np.ones(b.shape[:3]), poses).unsure == (1,)


def test_views_that_were_not_filmed_together_are_not_called_turned():
    board = Board("checkerboard", 8, 6, 30.0)
    b, poses, _ = seen(board, 2, 8, 1)
    poses[1] = {(k + 1) % 8: pose for k, pose in poses[1].items()}
    assert one_orientation(board, b, np.ones(b.shape[:3]), poses).unsure == ()


def test_a_charuco_board_is_left_as_it_is():
    board = Board("charuco", 8, 6, 30.0)
    b, poses, _ = seen(board, 2, 3, 0)
    assert np.array_equal(one_orientation(board, b, np.ones(b.shape[:3]), poses).b, b)
