"""Circles seen aslant: where their centroids lie beside their centres, and how well a picture gives them."""

import cv2
import numpy as np
import pytest

from tests.calibration.boards.test_board_fit import SIZE, cameras
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_circles import centroid_shift, disc_centroids
from vidtrack.calibration.boards.board_fit import fit_board
from vidtrack.geometry.camera import project

CAMERA = cameras(1)[0]
R = cv2.Rodrigues(np.array([0.6, -0.2, 0.1]))[0]
T = np.array([20.0, -10.0, 500.0])
CENTRES = np.array([[0.0, 0, 0], [60, 40, 0], [-80, 10, 0]])


def test_the_shift_is_that_of_the_mean_of_the_disc_in_the_picture():
    """The disc by many small parts, each as large as the picture shows it."""
    step = (np.arange(400) + 0.5) / 400 * 40 - 20
    x, y = np.meshgrid(step, step)
    disc = np.stack([x, y, 0 * x], -1)[np.hypot(x, y) < 20]
    got = centroid_shift(CAMERA, R[None], T[None], CENTRES, 40.0)[0]
    for centre, shift in zip(CENTRES, got, strict=True):
        at = [project(CAMERA, (disc + centre + d) @ R.T + T) for d in ([0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0])]
        u, v = at[1] - at[0], at[2] - at[0]
        area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        mean = (at[0] * area[:, None]).sum(0) / area.sum()
        assert shift == pytest.approx(mean - project(CAMERA, centre @ R.T + T), abs=0.005)
    assert np.abs(got).max() > 0.2


def test_a_circle_seen_square_on_in_the_middle_is_not_shifted():
    middle = np.array([[0.0, 0, 0]])
    at = np.array([(CAMERA.Cx - 655.3) / 1400 * 500, 0.0, 500.0])
    assert np.abs(centroid_shift(CAMERA, np.eye(3)[None], at[None], middle, 40.0)).max() < 1e-3


def test_the_lens_of_circles_is_the_true_one_once_centroids_are_brought_to_centres(monkeypatch):
    """Without it f is off by many times its standard error."""
    board, rng = Board("circles", 8, 6, 30.0, marker=20.0), np.random.default_rng(2)
    b = np.full((1, 14, 48, 2), np.nan)
    for k in range(14):
        turn = cv2.Rodrigues(rng.normal(0, 0.45, 3) * [1, 1, 0.3])[0] @ np.diag([1, -1, -1.0])
        place = np.array([*rng.uniform(-60, 60, 2), rng.uniform(350, 600)]) - turn @ [120, 90, 0]
        at = project(CAMERA, board.corners @ turn.T + place)
        seen = at + centroid_shift(CAMERA, turn[None], place[None], board.corners, 20.0)[0]
        inside = (seen > 5).all(-1) & (seen < np.array(SIZE) - 6).all(-1)
        b[0, k] = np.where(inside[:, None], seen + rng.normal(0, 0.01, seen.shape), np.nan)

    def off(board):
        fit = fit_board(board, b, np.full(b.shape[:3], 0.01), [SIZE], 0, model="tsai")
        known = fit.uncertainties[0]
        return abs(fit.cameras[0].f - CAMERA.f) / known.standard_errors[known.names.index("f")]

    assert off(board) < 3.5
    assert off(Board("circles", 8, 6, 30.0, marker=0.1)) > 10  # as if they were points


def test_centroids_of_discs_are_good_to_what_their_sd_says():
    rng, off, sd = np.random.default_rng(0), [], []
    for _ in range(6):
        true = np.array([[60.0, 60], [130, 64], [58, 130], [130, 134]]) + rng.uniform(-0.5, 0.5, (4, 2))
        y, x = np.mgrid[0:200, 0:200]
        far = np.min([np.hypot(x - a, y - b) for a, b in true], 0)
        picture = 30 + 180 * np.clip(far - 18 + 0.5, 0, 1) + rng.normal(0, 2, far.shape)
        found, own = disc_centroids(np.clip(np.rint(picture), 0, 255).astype(np.uint8), true.round())
        off.append(found - true)
        sd.append(own)
    ratio = np.sqrt((np.array(off) ** 2).mean()) / np.mean(sd)
    assert 0.7 < ratio < 1.5
    assert np.mean(sd) < 0.02


def test_a_disc_nearer_to_the_edge_than_to_its_neighbour_is_measured_too():
    true = np.array([[22.3, 61.7], [90.2, 60.4]])
    y, x = np.mgrid[0:120, 0:200]
    far = np.min([np.hypot(x - a, y - b) for a, b in true], 0)
    picture = np.rint(30 + 180 * np.clip(far - 8 + 0.5, 0, 1)).astype(np.uint8)
    found, sd = disc_centroids(picture, true.round())
    assert np.abs(found - true).max() < 0.02
    assert sd.max() < 0.05


def test_a_disc_at_the_edge_of_the_picture_stays_where_it_was_given():
    picture = np.full((60, 60), 200, np.uint8)
    cv2.circle(picture, (4, 30), 10, 20, -1)
    found, sd = disc_centroids(picture, np.array([[4.0, 30.0]]))
    assert (found == [[4.0, 30.0]]).all()
    assert sd[0] == 0.1
