"""What views of a board say against it, against the lens, or against the way in which it was filmed."""

import cv2
import numpy as np
import pytest

from tests.calibration.boards.test_board_fit import BOARD, SIZE, cameras, fitted, views
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_doubts import board_doubts
from vidtrack.calibration.boards.board_fit import fit_board
from vidtrack.geometry.camera import project


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


def test_views_that_are_all_alike_leave_f_uncertain_by_the_share_that_is_named():
    b = views(3, 3, tilt=0.1)
    fit = fitted(b, model="tsai")
    (found,) = [f.text for f in board_doubts("cam1", BOARD, fit, 0, SIZE, "mm") if f.code == "board-views-poor"]
    sd = fit.uncertainties[0].standard_errors[fit.uncertainties[0].names.index("f")]
    assert f"f +- {100 * sd / fit.cameras[0].f:.1f} %" in found


@pytest.mark.parametrize(("out", "said"), [(-0.12, "smaller"), (0.0, ""), (0.12, "larger")])
def test_tags_whose_corners_lie_inwards_or_outwards_are_noted(out, said):
    """As a camera's gamma does it: the dark squares shrink, and the lens is the same to 0.1 %."""
    board, camera, rng = Board("apriltag", 6, 4, 30.0), cameras(1)[0], np.random.default_rng(0)
    b = np.full((1, 10, len(board.corners), 2), np.nan)
    for k in range(10):
        R = cv2.Rodrigues(rng.normal(0, 0.45, 3))[0] @ np.diag([1, -1, -1.0])
        p = (board.corners - board.corners.mean(0)) @ R.T + rng.uniform([-100, -60, 400], [100, 60, 700])
        at = project(camera, p)
        away = (at.reshape(-1, 4, 2) - at.reshape(-1, 4, 2).mean(1, keepdims=True)).reshape(-1, 2)
        b[0, k] = at + rng.normal(0, 0.05, at.shape) + out * away / np.linalg.norm(away, axis=-1, keepdims=True)
    fit = fit_board(board, b, np.full(b.shape[:3], 0.05), [SIZE], 0, model="tsai")
    found = [f.text for f in board_doubts("cam1", board, fit, 0, SIZE, "mm") if f.code == "board-tags-shrunk"]
    assert len(found) == bool(said)
    assert all(f"look {said} than" in text for text in found)
    assert fit.cameras[0].f == pytest.approx(camera.f, rel=1e-3)
