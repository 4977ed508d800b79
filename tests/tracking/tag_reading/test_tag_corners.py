"""The corners of a rendered tag are where the camera puts them, to their sd."""

import cv2
import numpy as np
import pytest

from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.board_picture import board_picture, drawing
from vidtrack.tracking.tag_reading.tag_corners import tag_corners

F = 500.0
CAMERA = Camera(99.5, 79.5, 1, 1, 1.0, F, -0.05 / F**2, np.eye(3), np.zeros(3), (200, 160))
SIDE = 60.0
SQUARE = SIDE / 0.75
CORNERS = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * SIDE / 2


def shown(side_px=60.0, number=7, turn=(0.4, 0.3, 0.1), noise=1.0, seed=0, centre=(0.0, 0.0)):
    """A picture of a tag in the middle, and its corners (4, 2) px."""
    R = cv2.Rodrigues(np.array(turn))[0] @ np.diag([1.0, -1.0, -1.0])
    T = np.array([*centre, F * SIDE / side_px])
    bitmap = drawing("apriltag", 1, 1, first=number)
    corner = T - R @ np.array([SQUARE / 2, SQUARE / 2, 0])
    picture = board_picture(CAMERA, R, corner, bitmap, SQUARE, noise=noise, rng=np.random.default_rng(seed))
    return picture, project(CAMERA, CORNERS @ R.T + T)


def test_corners_are_right_to_a_hundredth_of_a_pixel_and_sd_is_honest():
    z = []
    for seed in range(12):
        turn = np.random.default_rng(seed).normal(0, 0.35, 3)
        picture, truth = shown(side_px=40 + 4 * seed, turn=turn, noise=2.0, seed=seed)
        own = tag_corners(picture, truth + 0.7, 8)
        assert np.abs(own.b - truth).max() < 0.06
        z.append((own.b - truth) / own.sd)
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25


def test_no_corner_leans_inwards_or_outwards():
    """The mean side is right to 0.005 px: a side that is too short by as much puts a tag of 60 px 0.01 % too far."""
    off = []
    for seed in range(10):
        picture, truth = shown(seed=seed, centre=np.random.default_rng(seed).uniform(-2, 2, 2))
        own = tag_corners(picture, truth, 8)
        middle = truth.mean(0)
        outwards = (truth - middle) / np.linalg.norm(truth - middle, axis=-1, keepdims=True)
        off.append(((own.b - truth) * outwards).sum(-1))
    assert abs(np.mean(off)) < 0.005


def test_a_deep_picture_gives_the_same_corners():
    picture, truth = shown()
    own = tag_corners(picture, truth, 8)
    deep = tag_corners(picture.astype(np.uint16) * 16, truth, 8)
    np.testing.assert_allclose(deep.b, own.b, atol=1e-6)
    np.testing.assert_allclose(deep.sd, own.sd, rtol=1e-3)


@pytest.mark.parametrize("spoil", ["blur", "edge", "nothing there"])
def test_a_corner_that_cannot_be_measured_is_missing(spoil):
    picture, truth = shown()
    if spoil == "blur":
        picture = cv2.GaussianBlur(picture, (0, 0), 8)
    if spoil == "edge":
        cut = int(truth[:, 0].min() + 3)
        picture, truth = picture[:, cut:], truth - [cut, 0]
    if spoil == "nothing there":
        picture = np.full_like(picture, 110)
    assert np.isnan(tag_corners(picture, truth, 8).b).any()
