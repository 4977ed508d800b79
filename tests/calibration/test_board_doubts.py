"""What views of a board say against it, against the lens, or against the way in which it was filmed."""

import numpy as np

from tests.calibration.test_board_fit import BOARD, SIZE, fitted, views
from vidtrack.calibration.board_doubts import board_doubts


def codes(b):
    return {finding.code for finding in board_doubts("cam1", BOARD, fitted(b, model="tsai"), 0, SIZE, "mm")}


def test_a_board_that_is_bent_or_scaled_unevenly_is_doubtful():
    assert "board-bent" in codes(views(2, 25, bend=8.0))


def test_nothing_is_said_of_a_flat_board_that_is_shown_all_over_the_picture():
    assert codes(views(2, 25)) == set()


def test_corners_far_from_any_lens_are_doubtful():
    b = views(2, 12)
    assert "board-rough" in codes(b + np.random.default_rng(0).normal(0, 1.5, b.shape))


def test_a_board_kept_in_a_corner_is_doubtful():
    b = views(1, 20)
    b[(b[..., 0] > 700) | (b[..., 1] > 420)] = np.nan
    b = b[:, np.isfinite(b[0, ..., 0]).sum(-1) >= 6]
    assert {"board-in-a-corner", "board-views-poor"} & codes(b)
