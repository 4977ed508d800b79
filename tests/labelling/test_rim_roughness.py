"""What errors that all frames share do to calibration balls, against where the drawn balls are."""

from typing import NamedTuple

import cv2
import numpy as np
import pytest

from tests.lit_balls import noisy, picture
from vidtrack.labelling.rim_roughness import ROUGHNESS, rim, with_roughness
from vidtrack.labelling.shot import take

GRID = [(x, y) for x in range(25, 200, 30) for y in (25, 58, 91)]
PLACES = [(x + 0.37 * k % 1, y + 0.61 * k % 1, 5.0) for k, (x, y) in enumerate(GRID)]


class Still(NamedTuple):
    luma: np.ndarray
    corrupt: bool = False


def coded(picture, quality):
    """As JPEG leaves it: an error that a coder would copy into all pictures that follow."""
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE)


def shot(frames, polarity="bright"):
    return take([Still(255 - frame if polarity == "dark" else frame) for frame in frames], {"polarity": polarity})


def sd_of(own, pixels=None):
    pixels = own.blobs.pixels.astype(float) if pixels is None else pixels
    return with_roughness({"front": own}, ["front"] * len(own.at), own.at, own.sd, pixels)


def error_of(own, light):
    """(n, 2) px, beside the same balls without noise and code."""
    clean = shot([np.rint(light).astype(np.uint8)], own.settings["polarity"]).at
    return own.at - clean[np.linalg.norm(own.at[:, None] - clean, axis=-1).argmin(axis=1)]


@pytest.mark.parametrize("polarity", ["bright", "dark"])
@pytest.mark.parametrize("quality", [20, 50, 80])
def test_the_sd_holds_errors_that_a_coder_copies_into_every_frame(quality, polarity):
    rng = np.random.default_rng(quality)
    light = picture((116, 200), PLACES, lamp=None)
    copied = shot([coded(noisy(light, rng), quality)] * 8, polarity)
    off, sd = error_of(copied, light), sd_of(copied)
    assert np.median(copied.sd) < 0.4 * off.std()  # eight copies do not scatter
    assert 0.6 * off.std() < np.median(sd) < 2.0 * off.std()


def test_noise_that_differs_from_frame_to_frame_hardly_changes_the_sd():
    rng = np.random.default_rng(3)
    light = picture((116, 200), PLACES, lamp=None)
    fresh = shot([noisy(light, rng, noise=4.0) for _ in range(8)])
    assert np.median(sd_of(fresh)) < 1.5 * max(np.median(fresh.sd), error_of(fresh, light).std())


def test_what_fewer_than_half_of_the_balls_have_beside_them_adds_nothing():
    rng = np.random.default_rng(5)
    light = picture((116, 200), PLACES, lamp=None)
    plain = shot([noisy(light, rng) for _ in range(8)])
    light[20:27, 26:34] += 60  # beside the first of eighteen
    assert np.median(sd_of(shot([noisy(light, rng) for _ in range(8)]))) < 1.3 * np.median(sd_of(plain))


def test_points_of_a_person_and_too_few_balls_keep_their_sd():
    rng = np.random.default_rng(1)
    copied = shot([coded(noisy(picture((116, 200), PLACES, lamp=None), rng), 30)] * 8)
    assert (sd_of(copied, np.zeros(len(copied.at))) == copied.sd).all()
    few = np.where(np.arange(len(copied.at)) < ROUGHNESS.fewest - 1, copied.blobs.pixels, 0).astype(float)
    assert (sd_of(copied, few) == copied.sd).all()


def test_a_rim_with_three_bulges_has_their_height_and_an_ellipse_has_none():
    y, x = np.mgrid[:61, :61] - 30.0
    angle, r = np.arctan2(y, x), np.hypot(x, y)
    bulged = 200 * np.clip(12 + 0.4 * np.cos(3 * angle - 0.5) - r + 0.5, 0, 1)
    pixels = np.pi * 12.0**2
    found = rim(bulged, np.array([30.0, 30.0]), pixels, np.zeros((0, 2)))
    assert found == pytest.approx([0.4 * np.cos(0.5), 0.4 * np.sin(0.5)], abs=0.03)
    ellipse = 200 * np.clip(12 - np.hypot(x, y / 0.8) + 0.5, 0, 1)
    assert rim(ellipse, np.array([30.0, 30.0]), 0.8 * pixels, np.zeros((0, 2))) == pytest.approx([0, 0], abs=1e-6)
    assert rim(bulged, np.array([10.0, 30.0]), pixels, np.zeros((0, 2))) is None
    assert rim(bulged, np.array([30.0, 30.0]), pixels, np.array([[50.0, 40.0]])) is None
