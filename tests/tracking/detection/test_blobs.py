"""Blobs of drawn pictures, and of a real one."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.discs import picture
from vidtrack.tracking.detection.blobs import find_blobs, rough_blobs

REAL = Path(__file__).parents[2] / "../shared/real/one-dot/calibration/target"
BALLS = [(30.2, 20.7, 4.0), (90.6, 22.1, 4.0), (60.5, 50.3, 6.0), (30.9, 80.4, 2.0), (95.3, 85.8, 4.0)]


def drawn(seed=0, noise=3.0, targets=BALLS, shape=(110, 130), **settings):
    return picture(shape, targets, noise=noise, rng=np.random.default_rng(seed), **settings)


def in_order(targets):
    return np.array(sorted((t[:2] for t in targets), key=lambda t: (t[1], t[0])))


def test_every_ball_is_found_from_top_to_bottom_and_nothing_else():
    found = find_blobs(drawn())
    assert np.abs(np.stack([found.Xf, found.Yf], 1) - in_order(BALLS)).max() < 0.06
    assert not found.edge.any()


def test_pixels_and_boxes_are_those_above_the_threshold():
    image = np.full((40, 40), 10, np.uint8)
    image[12:17, 20:23] = 200
    found = find_blobs(image, threshold=100)
    assert (found.pixels, found.left, found.top, found.width, found.height) == (15, 20, 12, 3, 5)
    assert (found.Xf[0], found.Yf[0]) == pytest.approx((21, 14))
    assert found.mass[0] == pytest.approx(15 * 190)


@pytest.mark.parametrize("kind", ["weighted", "binary", "ellipse"])
def test_dark_balls_are_bright_ones_turned(kind):
    bright = drawn(level=25)
    a, b = find_blobs(bright, centroid=kind), find_blobs(255 - bright, polarity="dark", centroid=kind)
    for x, y in zip(a, b, strict=True):
        assert x == pytest.approx(y)


def test_a_threshold_by_hand_means_the_same_in_both_polarities():
    bright = drawn(noise=0)
    a, b = find_blobs(bright, threshold=150), find_blobs(255 - bright, polarity="dark", threshold=105)
    assert (a.pixels == b.pixels).all()


def test_the_threshold_is_in_grey_levels_of_any_depth():
    eight, ten = drawn(noise=0), drawn(noise=0, dtype=np.uint16)
    a, b = find_blobs(eight, threshold=120), find_blobs(ten, threshold=120, bits=10)
    assert np.abs(a.pixels - b.pixels).max() <= 2
    assert a.Xf == pytest.approx(b.Xf, abs=0.01)
    assert find_blobs(drawn(noise=0, dtype=float), threshold=120).Xf == pytest.approx(a.Xf, abs=0.01)


def test_a_background_that_varies_hides_no_ball():
    """From 20 grey levels on the left to 170 on the right; contrast 60: no one threshold finds them all."""
    level = np.tile(20 + 150 * np.arange(400) / 400, (300, 1))
    targets = [(40.0 + 80 * i + 0.3 * j, 40.0 + 70 * j + 0.2 * i, 4.0, 60.0) for i in range(5) for j in range(4)]
    found = find_blobs(drawn(targets=targets, shape=(300, 400), level=level))
    assert len(found.Xf) == 20
    assert np.abs(np.stack([found.Xf, found.Yf], 1) - in_order(targets)).max() < 0.12


def test_noise_alone_has_no_blobs():
    for seed in range(5):
        assert find_blobs(drawn(seed, targets=[], noise=8.0), min_pixels=1).Xf.size == 0


def test_a_ball_cut_by_the_edge_is_told():
    found = find_blobs(drawn(targets=[(1.0, 50.0, 4.0), (60.0, 50.0, 4.0)]))
    assert found.edge.tolist() == [True, False] or found.edge[np.argsort(found.Xf)].tolist() == [True, False]


def test_small_blobs_are_left_out():
    image = drawn(targets=[(30.0, 30.0, 1.2), (60.0, 60.0, 4.0)], noise=0)
    assert find_blobs(image, min_pixels=10).Xf.size == 1
    assert find_blobs(image, min_pixels=1).Xf.size == 2


def test_blobs_as_large_as_the_picture_are_measured_too():
    found = find_blobs(drawn(targets=[(64.3, 54.6, 40.0)]), threshold=130)
    assert (found.Xf[0], found.Yf[0]) == pytest.approx((64.3, 54.6), abs=0.02)


def test_a_picture_with_colours_is_refused():
    with pytest.raises(ValueError, match="two axes"):
        find_blobs(np.zeros((4, 4, 3), np.uint8))


def test_rough_blobs_are_where_the_measured_ones_are():
    image = drawn()
    rough = rough_blobs(image, (image > 120).view(np.uint8), scale=1.0, min_pixels=4)
    fine = find_blobs(image, threshold=120)
    assert (rough.pixels == fine.pixels).all()
    assert rough.Xf == pytest.approx(fine.Xf, abs=0.3)
    assert rough.mass / rough.pixels == pytest.approx(fine.mass / fine.pixels, rel=0.15)


@given(st.integers(0, 3), st.booleans())
@settings(max_examples=8, deadline=None)
def test_turning_the_picture_by_quarters_turns_the_blobs(quarters, mirrored):
    image = drawn(noise=0, shape=(120, 120))
    turned = np.ascontiguousarray(np.rot90(image[:, ::-1] if mirrored else image, quarters))
    a, b = find_blobs(image, threshold=120), find_blobs(turned, threshold=120)
    place = np.stack([a.Xf, a.Yf], 1) - 59.5
    place = place * (-1, 1) if mirrored else place
    for _ in range(quarters):
        place = place[:, ::-1] * (1, -1)
    near = np.hypot(*(place[:, None] + 59.5 - np.stack([b.Xf, b.Yf], 1)).transpose(2, 0, 1)).min(axis=1)
    assert near.max() < 0.01


@pytest.mark.skipif(not REAL.exists(), reason="the real pictures are not here")
@pytest.mark.parametrize("camera", ["cam1", "cam2", "cam3", "cam4"])
def test_all_105_dots_of_a_real_target_are_found_without_a_threshold(camera):
    found = find_blobs(cv2.imread(str(REAL / f"{camera}.tif"), cv2.IMREAD_UNCHANGED))
    assert len(found.Xf) == 105


def test_a_ball_before_a_bright_pattern_keeps_its_own_size():
    y, x = np.mgrid[:120, :160].astype(float)
    pattern = 70 + 14 * (1 + np.sin(x / 3) * np.sin(y / 3)) * (np.abs(x - 80) < 70)
    ball = 1 / (1 + np.exp(2 * (np.hypot(x - 81.3, y - 58.8) - 6)))
    picture = np.clip(np.random.default_rng(3).normal(pattern * (1 - ball) + 220 * ball, 1.0), 0, 255).astype(np.uint8)
    blobs = find_blobs(picture)
    k = np.argmin(np.hypot(blobs.Xf - 81.3, blobs.Yf - 58.8))
    assert np.hypot(blobs.Xf[k] - 81.3, blobs.Yf[k] - 58.8) < 0.3
    assert 90 < blobs.pixels[k] < 150
