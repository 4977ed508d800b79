"""A camera's history in a run: no alarm in 60 scenes in which it stood, every turn found, placed and sized."""

import cv2
import numpy as np
import pytest

from tests.steadiness.scenes import F, Wall, course_of
from vidtrack.steadiness.history import displaced, episode, field, history, since_calibration
from vidtrack.steadiness.turn import law_of_picture

STILL = np.zeros(4)
SIZE = (320, 240)


def case(wall, film, law=None):
    course = course_of(film)
    law = law or wall.law
    own = history(course, course.frames / 30, law, SIZE)
    return own, episode(own, law, SIZE)


def disturbance(kind, rng):
    """Light, picture after picture, and what passes before the wall."""
    if kind == "light":
        rate, swing = rng.uniform(-0.03, 0.03), rng.uniform(0, 0.2)
        return lambda k: 1 + rate * k + swing * np.sin(k), None
    if kind == "person":
        coat = Wall(rng, contrast=20).clean()[:, :90]
        pace = rng.uniform(2, 12)

        def walk(k, picture):
            left = int(rng.integers(0, 3) + pace * k)
            picture = picture.copy()
            shown = picture[:, left : left + 90]
            shown[:] = coat[:, : shown.shape[1]]
            return picture

        return (lambda k: 1.0), walk
    if kind == "water":
        level = int(rng.integers(110, 160))
        phase, long = rng.uniform(0, 6, 6), rng.uniform(12, 40, 6)
        y, x = np.mgrid[level:240, 0:320].astype(float)

        def waves(k, picture):
            picture = picture.copy()
            picture[level:] = 60 + sum(
                6
                * np.sin(2 * np.pi * (x + (0.4 * y if i % 2 else -0.7 * y)) / long[i] + phase[i] + (0.5 + 0.2 * i) * k)
                for i in range(6)
            )
            return picture

        return (lambda k: 1.0), waves
    y, x = np.mgrid[0:240, 0:320].astype(float)
    slope = rng.uniform(-1, 1)

    def shadow(k, picture):
        return picture * np.where(x + slope * y < 12 * k, 0.6, 1.0)

    return (lambda k: 1.0), shadow


def alarm_of_a_still_camera(seed):
    rng = np.random.default_rng(100 + seed)
    wall = Wall(rng, contrast=rng.uniform(5, 20), grain=rng.uniform(1.2, 4))
    light, over = disturbance(("light", "person", "water", "shadow")[seed % 4], rng)
    quality = (None, 85)[seed // 4 % 2]
    own, moved = case(wall, wall.film([STILL] * 14, rng.uniform(1, 4), light, over, quality))
    assert own.of > 6
    return moved


@pytest.mark.parametrize("seed", range(16))
def test_a_camera_that_stood_still_raises_no_alarm(seed):
    assert alarm_of_a_still_camera(seed) is None


@pytest.mark.parametrize("seed", range(16, 60))
def test_a_camera_that_stood_still_raises_no_alarm_in_many_films(seed):
    assert alarm_of_a_still_camera(seed) is None


@pytest.mark.parametrize("px", [0.4, 2.0, 12.0, 30.0])
@pytest.mark.parametrize("kind", ["sudden", "slow", "back"])
def test_a_camera_that_turned_is_found_with_its_size_and_time(px, kind):
    wall = Wall(np.random.default_rng(11))
    turn = np.array([0.6, 0.8, 0.1, 0.0]) * px / F
    ways = {"sudden": [0] * 8 + [1] * 8, "slow": [k / 15 for k in range(16)], "back": [0] * 5 + [1] * 5 + [0] * 6}
    _, moved = case(wall, wall.film([share * turn for share in ways[kind]]))
    assert moved is not None
    assert moved.most.px == pytest.approx(px, rel=0.08, abs=4 * moved.most.sd)
    assert abs(moved.most.px - displaced(wall.law, turn, np.eye(4) * 1e-12, SIZE).px) < 5 * moved.most.sd + 0.1 * px * (
        kind == "slow"  # the first pictures' mean is not the first picture
    )
    if kind == "sudden":
        assert moved.sudden
        assert moved.begun <= 7 / 30 <= 8 / 30 <= moved.ended + 1e-9
    if kind == "back":
        assert moved.last.px < 0.15
    if kind == "slow" and px > 1:
        assert not moved.sudden


def test_a_small_zoom_is_found():
    wall = Wall(np.random.default_rng(12))
    _, moved = case(wall, wall.film([STILL] * 6 + [np.array([0, 0, 0, 0.01])] * 6))
    assert moved is not None
    assert moved.most.px == pytest.approx(0.01 * np.sqrt((field(SIZE) - 160 + [0, 40]).var(0).sum()), rel=0.3)


def test_a_picture_without_a_camera_shows_the_same_displacement():
    wall, turn = Wall(np.random.default_rng(13)), np.array([3.0, 4, 0, 0]) / F
    _, moved = case(wall, wall.film([STILL] * 6 + [turn] * 6), law_of_picture(SIZE))
    assert moved is not None
    assert moved.most.px == pytest.approx(5, rel=0.05)


def test_the_way_from_the_calibration_is_added():
    wall, rng = Wall(np.random.default_rng(14)), np.random.default_rng(15)
    before, after = np.array([4.0, -3, 1, 0]) / F, np.array([-2.0, 5, 0, 0]) / F
    calibrated = wall.clean()
    begun = np.mean([f.luma for f in wall.film([before] * 4)], axis=0)
    shut = np.zeros((240, 320), bool)
    since, alike = since_calibration(calibrated + rng.normal(0, 1, calibrated.shape), begun, wall.law, SIZE, 1, shut)
    assert alike > 0.8
    course = course_of(wall.film([before] * 5 + [wall.law.after(after, before)] * 5))
    own = history(course, course.frames / 30, wall.law, SIZE, since, alike)
    for got, true in ((own.theta[0], before), (own.theta[-1], wall.law.after(after, before))):
        assert F * got == pytest.approx(F * true, abs=0.12)
    z = (own.theta[0] - before) / np.sqrt(np.diag(own.covariance[0]))
    assert np.abs(z).max() < 4


def test_another_view_resembles_nothing():
    wall, other = Wall(np.random.default_rng(16)), Wall(np.random.default_rng(17))
    since, alike = since_calibration(wall.clean(), other.clean(), wall.law, SIZE, 1, np.zeros((240, 320), bool))
    assert since.why
    assert alike < 0.15


def test_fuzzy_pictures_are_still_compared():
    wall = Wall(np.random.default_rng(18), grain=3)

    def soft(k, picture):
        return cv2.GaussianBlur(picture, (0, 0), 1 + 0.1 * k)

    _, moved = case(wall, wall.film([STILL] * 8, over=soft))
    assert moved is None
