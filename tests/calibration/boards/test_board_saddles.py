"""Corners of squares to a hundredth of a pixel, wherever they lie between the pixels, with a sigma that holds."""

import cv2
import numpy as np
import pytest
from scipy.special import erf

from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen
from vidtrack.calibration.boards.board_saddles import saddle_corners
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.board_picture import board_picture, drawing

SIZE = (60, 60)


def crossing(c, turns=(0.0, 0.0), blur=0.5, over=16):
    """Levels of four squares that meet in c (2,), the mean of over x over positions in each pixel."""
    at = (np.arange(SIZE[0] * over) + 0.5) / over - 0.5
    x, y = at[None] - c[0], at[:, None] - c[1]
    first = erf((x * np.cos(turns[0]) + y * np.sin(turns[0])) / blur / 2**0.5)
    second = erf((y * np.cos(turns[1]) - x * np.sin(turns[1])) / blur / 2**0.5)
    return (120 + 90 * first * second).reshape(SIZE[1], over, SIZE[0], over).mean((1, 3))


def measured(picture, rough, side=20.0, free=1.0):
    rough = np.atleast_2d(rough)
    across, up = np.tile([side, 0.0], (len(rough), 1)), np.tile([0.0, -side], (len(rough), 1))
    return saddle_corners(np.clip(np.rint(picture), 0, 255).astype(np.uint8), rough, across, up, free)


@pytest.mark.parametrize("turns", [(0.0, 0.0), (0.3, 0.3), (0.2, -0.3)])
@pytest.mark.parametrize("blur", [0.3, 0.8, 2.0])
def test_a_corner_is_found_wherever_it_lies_between_the_pixels(turns, blur):
    for phase in np.linspace(0, 0.9, 7):
        c = np.array([30 + phase, 29.7 - phase / 2])
        found, sd = measured(crossing(c, turns, blur), c + np.array([0.6, -0.5]))
        np.testing.assert_allclose(found[0], c, atol=0.01)
        assert sd[0] < 0.02


def test_levels_that_rise_to_one_side_and_a_power_of_light_move_no_corner():
    c = np.array([30.3, 29.8])
    sloped = crossing(c) * 0.8 + 0.6 * np.arange(SIZE[0])
    np.testing.assert_allclose(measured(sloped, c + 0.3)[0][0], c, atol=0.01)
    bent = 255 * (crossing(c, (0.2, 0.1)) / 255) ** (1 / 2.2)
    np.testing.assert_allclose(measured(bent, c + 0.3)[0][0], c, atol=0.01)


def test_the_sd_is_that_of_the_noise():
    c, rng = np.array([30.3, 29.8]), np.random.default_rng(0)
    clean = crossing(c, (0.2, 0.1), 0.8)
    z = []
    for _ in range(60):
        found, sd = measured(clean + rng.normal(0, 5, clean.shape), c + 0.2)
        z.append((found[0] - c) / sd[0])
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25


def test_what_is_no_crossing_of_two_edges_is_not_measured():
    c = np.array([30.3, 29.8])
    edge = np.where(np.arange(SIZE[0]) > 30, 200.0, 40.0)[None].repeat(SIZE[1], 0)
    quarter = crossing(c)
    quarter[:30, :30] = quarter[30:, :30] = quarter[0, -1]
    hidden = crossing(c)
    hidden[:, 31:] = 110
    for picture in (np.full(SIZE, 100.0), edge, quarter, hidden):
        found, sd = measured(picture, c)
        assert np.isnan(found).all()
        assert np.isnan(sd).all()
    assert np.isfinite(measured(crossing(c), c)[1]).all()
    assert np.isnan(measured(crossing(c), c + 3.0)[1]).all()


def test_one_corner_out_of_the_picture_costs_no_other():
    c = np.array([30.3, 29.8])
    found, sd = measured(crossing(c), [[-20.0, 5.0], c, [np.nan, np.nan]])
    assert np.isfinite(sd).tolist() == [False, True, False]
    np.testing.assert_allclose(found[1], c, atol=0.01)


@pytest.mark.parametrize(("kind", "columns", "rows"), [("charuco", 8, 6), ("checkerboard", 8, 5)])
def test_corners_of_a_board_seen_square_on_do_not_err_together(kind, columns, rows):
    """Whole rows of corners lie alike between the pixels there: by OpenCV's cornerSubPix they erred by 0.06 px."""
    camera = Camera(239.3, 181.2, 1, 1, 1.0, 520.0, 0.0, np.eye(3), np.zeros(3), (480, 360))
    R, rng = np.diag([1.0, -1.0, -1.0]), np.random.default_rng(0)
    board, off = Board(kind, columns, rows, 30.0), []
    for _ in range(4):
        T = np.array([*rng.uniform(-1, 1, 2), 620.0]) - R @ [15.0 * columns, 15.0 * rows, 0]
        seen = board_seen(board, board_picture(camera, R, T, drawing(kind, columns, rows), 30.0, rng=rng))
        own = seen.b - project(camera, board.corners @ R.T + T)[seen.ids]
        other = seen.b - project(camera, board.corners[::-1] @ R.T + T)[seen.ids]
        off.append(min(own, other, key=np.linalg.norm))
    assert np.sqrt(np.mean(np.concatenate(off) ** 2)) < 0.01


def test_a_corner_that_a_hand_hides_in_part_keeps_the_detector_s_place_and_a_large_sd():
    camera = Camera(239.3, 181.2, 1, 1, 1.0, 520.0, 0.0, np.eye(3), np.zeros(3), (480, 360))
    R = cv2.Rodrigues(np.array([0.2, 0.1, 0.0]))[0] @ np.diag([1.0, -1.0, -1.0])
    T = np.array([0, 0, 520.0]) - R @ [120.0, 90.0, 0]
    board = Board("charuco", 8, 6, 30.0)
    picture = board_picture(camera, R, T, drawing("charuco", 8, 6), 30.0)
    at = project(camera, board.corners @ R.T + T)[17]
    picture[int(at[1]) - 9 : int(at[1]) + 10, int(at[0]) + 1 : int(at[0]) + 10] = 120
    seen = board_seen(board, picture)
    assert np.median(seen.sd) < 0.02
    assert (seen.sd[seen.ids == 17] >= 0.1).all()
