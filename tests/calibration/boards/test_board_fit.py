"""Cameras from a board: as good as OpenCV's on the same corners, places to each other, what is refused."""

import cv2
import numpy as np
import pytest

from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_fit import NoLens, fit_board, seen_corners
from vidtrack.geometry.camera import Camera, project

BOARD = Board("charuco", 9, 7, 30.0)
SIZE = (1280, 720)
NOISE = 0.1


def cameras(m):
    turns = [cv2.Rodrigues(np.array([0, 0.35 * i, 0.0]))[0] for i in range(m)]
    return [
        Camera(655.3, 350.2, 1, 1, 1.001, 1400.0, -0.08 / 1400**2, R, np.array([-350.0 * i, 0, 60.0 * i]), SIZE)
        for i, R in enumerate(turns)
    ]


def views(seed, n, m=1, tilt=0.45, bend=0.0):
    """Where the cameras see the corners, (m, n, q, 2) px, noise included; NaN outside the pictures."""
    rng, seen_by = np.random.default_rng(seed), cameras(m)
    p, _ = BOARD.shaped({"bend_xx": bend})
    b = np.full((m, n, len(p), 2), np.nan)
    for k in range(n):
        R = cv2.Rodrigues(rng.normal(0, tilt, 3) * [1, 1, 2])[0] @ np.diag([1, -1, -1.0])
        x = (p - p.mean(0)) @ R.T + rng.uniform([-150, -80, 450], [150 + 150 * (m > 1), 80, 900])
        for i, camera in enumerate(seen_by):
            at = project(camera, x)
            inside = (at > 0).all(-1) & (at < [SIZE[0] - 1, SIZE[1] - 1]).all(-1)
            b[i, k] = np.where(inside[:, None], at + rng.normal(0, NOISE, at.shape), np.nan)
    return b


def fitted(b, world=0, **how):
    return fit_board(BOARD, b, np.full(b.shape[:3], NOISE), [SIZE] * len(b), world, **how)


def by_opencv(b):
    seen = [np.isfinite(view).all(-1) for view in b[0]]
    points = [BOARD.corners[s].astype(np.float32) for s in seen]
    corners = [view[s].astype(np.float32)[:, None] for view, s in zip(b[0], seen, strict=True)]
    return cv2.calibrateCamera(points, corners, SIZE, None, None)[1]


def test_a_lens_from_forty_views_is_not_worse_than_opencv_s():
    """Rms over three sets: f within 0.05 %, the centre within 0.5 px, and neither worse than calibrateCamera's."""
    truth = cameras(1)[0]
    ours, theirs = [], []
    for seed in range(3):
        b = views(seed, 40)
        found, K = fitted(b).cameras[0], by_opencv(b)
        ours.append([100 * (found.f / truth.f - 1), found.Cx - truth.Cx, found.Cy - truth.Cy])
        theirs.append([100 * (K[1, 1] / truth.f - 1), K[0, 2] - truth.Cx, K[1, 2] - truth.Cy])
    own, other = np.sqrt(np.mean(np.square(ours), 0)), np.sqrt(np.mean(np.square(theirs), 0))
    assert own[0] < max(0.05, 1.1 * other[0])
    assert own[1:].max() < max(0.5, 1.1 * other[1:].max())


def test_sigma_is_honest_and_the_noise_is_found():
    z, truth = [], cameras(1)[0]
    for seed in range(6):
        fit = fitted(views(seed, 12), model="tsai")
        sd = dict(zip(fit.uncertainties[0].names, fit.uncertainties[0].standard_errors, strict=True))
        z += [(getattr(fit.cameras[0], name) - getattr(truth, name)) / sd[name] for name in ("f", "Cx", "Cy")]
        assert fit.sigma_px == pytest.approx(NOISE, rel=0.1)
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.6


def test_two_cameras_are_placed_to_each_other_and_the_world_is_the_board():
    b = views(1, 16, m=2)
    fit = fitted(b, world=3, model="tsai")
    apart = np.linalg.norm(fit.cameras[0].position - fit.cameras[1].position)
    truth = [camera.position for camera in cameras(2)]
    assert apart == pytest.approx(np.linalg.norm(truth[0] - truth[1]), rel=1e-3)
    np.testing.assert_allclose(seen_corners(BOARD, fit)[3][:, :2], BOARD.corners[:, :2], atol=0.05)
    np.testing.assert_allclose(fit.poses[3], np.eye(3, 4), atol=1e-12)


def test_a_bent_board_is_found_bent():
    fit = fitted(views(2, 25, bend=3.0), model="tsai")
    assert fit.shape["bend_xx"] == pytest.approx(3.0, abs=0.4)
    assert fit.cameras[0].f == pytest.approx(1400, rel=2e-3)


def test_a_corner_that_is_wrong_is_left_out():
    b = views(3, 12)
    there = np.argwhere(np.isfinite(b[0]).all(-1))[5]
    b[0, there[0], there[1]] += [4.0, -3.0]
    fit = fitted(b, model="tsai")
    assert np.isnan(fit.residuals[0, there[0], there[1]]).all()
    assert fit.sigma_px == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize(
    ("b", "line"),
    [
        (views(0, 8, tilt=0.0), "parallel"),
        (views(0, 2), "2 views of the board; 3 are needed"),
        (np.concatenate([views(0, 6), np.full((1, 6, 48, 2), np.nan)]), "0 views"),
    ],
)
def test_views_that_determine_no_lens_are_refused(b, line):
    with pytest.raises(NoLens, match=line):
        fitted(b)


def test_cameras_that_share_no_view_are_refused():
    b = views(1, 16, m=2)
    b[0, :8], b[1, 8:] = np.nan, np.nan
    with pytest.raises(NoLens, match="shares no view"):
        fitted(b, world=10, model="tsai")


def test_a_view_of_which_every_corner_is_wrong_is_left_out_and_costs_no_lens():
    b = views(1, 14)
    rng = np.random.default_rng(0)
    b[0, 5] += rng.normal(0, 40, b[0, 5].shape)
    fit = fitted(b, model="tsai")
    assert not np.isfinite(fit.residuals[0, 5]).any()
    assert np.isfinite(fit.residuals[0]).any((1, 2)).sum() == 13
    assert fit.cameras[0].f == pytest.approx(1400, rel=5e-3)
    with pytest.raises(NoLens, match="the world does not fit the other views"):
        fitted(b, world=5, model="tsai")


def test_no_corner_counts_as_better_known_than_a_hundredth_of_a_pixel():
    """Whatever little the residuals leave: along rows of a board seen square on errors are common."""
    b = views(1, 12)
    clean = b - fitted(b, model="tsai").residuals
    done = fit_board(BOARD, clean, np.full(clean.shape[:3], 0.01), [SIZE], 0, model="tsai")
    assert done.sigma_px == pytest.approx(0.01)
