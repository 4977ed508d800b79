"""Centroids before a wall with a pattern: it is made even where it is known, and in the sd where it is not."""

from fractions import Fraction

import cv2
import numpy as np
import pytest

from tests.discs import disc
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.backdrop import still_wall as still_walls
from vidtrack.tracking.backdrop.still_wall import still_wall
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.sample import Sample

SHAPE, RADIUS, NOISE = (90, 150), 6.0, 1.5


def rough(sd, grain=4.0):
    grey = cv2.GaussianBlur(np.random.default_rng(1).normal(0, 1, SHAPE).astype(np.float32), (0, 0), grain)
    return 70 + sd * np.clip(grey / grey.std(), -2.5, 2.5)


def path(k, speed):
    return 30 + speed * k, 44 + 8 * np.sin(speed * k / 9)


def picture(wall, k, speed=1.5, dark=False, blur=1.5):
    cover = cv2.GaussianBlur(disc(SHAPE, *path(k, speed), RADIUS), (0, 0), blur)
    grey = wall + cover * (190 - wall) + np.random.default_rng(k).normal(0, NOISE, SHAPE)
    return np.clip(np.rint(255 - grey if dark else grey), 0, 255).astype(np.uint8)


def followed(wall, n=60, speed=1.5, *, dark=False, lines=1):
    """Errors and sd (n, 2) px of a ball, and flags."""
    frames = [Frame(k, Fraction(k, 25), picture(wall, k, speed, dark), False, None) for k in range(n)]
    info = VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive")
    table = track(frames, info, targets=1, polarity="dark" if dark else "bright", fields="frame").centroids
    truth = np.array([path(k, speed) for k in range(n)])
    return table[["Xf", "Yf"]].to_numpy() - truth, table[["sd_x", "sd_y"]].to_numpy(), table["flag"]


@pytest.mark.parametrize("dark", [False, True])
def test_a_pattern_behind_a_soft_rim_moves_no_centroid_by_more_than_its_sd(dark, monkeypatch):
    error, sd, flag = followed(rough(14), dark=dark)
    assert (flag == "").mean() > 0.9
    late = slice(20, None)
    assert np.nanstd(error[late]) < 0.06
    assert 0.5 < np.sqrt(np.nanmean((error / sd)[late] ** 2)) < 1.5
    assert not (np.abs(error) > np.maximum(5 * sd, 0.1)).any()
    monkeypatch.setattr(still_walls, "still_wall", lambda *_: None)
    assert np.nanstd(followed(rough(14), dark=dark)[0][late]) > 2 * np.nanstd(error[late])


def test_where_a_ball_has_always_been_its_sd_holds_what_the_wall_may_do():
    error, sd, flag = followed(rough(14), speed=0.1)
    good = (flag == "").to_numpy()
    assert good.mean() > 0.9
    assert (np.abs(error) < 3 * sd)[good].all()
    assert np.median(sd[good]) > 0.05


def opening(wall, n=12):
    return [Sample(picture(wall, k), float(k)) for k in range(n)]


def wall_of(samples):
    detection = Detection(noise=NOISE)
    backgrounds = background_of(samples, detection)
    return still_wall(backgrounds, samples, detection, np.array([[18.0, 30.0, 60.0, 60.0]]), 120.0)


def test_a_plain_wall_or_one_with_fine_grain_is_left_as_it_is():
    assert wall_of(opening(rough(14))) is not None
    assert wall_of(opening(np.full(SHAPE, 70.0))) is None
    assert wall_of(opening(70 + np.random.default_rng(3).normal(0, 2, SHAPE))) is None
    assert wall_of(opening(rough(14), n=4)) is None


def test_balls_that_fill_much_of_a_small_picture_hide_no_pattern():
    assert wall_of([sample._replace(luma=sample.luma[20:, :80]) for sample in opening(rough(14))]) is not None


def test_a_pattern_that_does_not_stand_is_no_wall():
    assert wall_of([Sample(picture(np.roll(rough(14), 7 * k, axis=1), k), float(k)) for k in range(12)]) is None
