"""The course of a background through a recording: more pictures where it moves, none where a target hides it."""

import numpy as np
import pytest

from tests.steadiness.scenes import NO_TARGETS, F, Wall, course_of, turns
from vidtrack.steadiness.series import Course, Targets, covered

STILL = np.zeros(4)


def test_a_sudden_turn_is_placed_between_two_pictures_that_were_kept():
    wall, turned = Wall(np.random.default_rng(1)), np.array([5.0, 3, 0, 0]) / F
    course = course_of(wall.film([STILL] * 41 + [turned] * 39), stride=2)
    shift = np.nanmedian(course.shift, axis=1)
    moved = np.abs(shift).max(1) > 1
    assert course.frames[moved].min() == 42
    assert course.frames[~moved].max() == 40
    assert len(course.frames) < 25


def test_a_recording_at_rest_is_looked_at_seldom():
    wall = Wall(np.random.default_rng(2))
    course = course_of(wall.film([STILL] * 100))
    assert len(course.frames) <= 14
    assert course.frames[0] == 0
    assert course.frames[-1] == 99


def test_the_course_is_right_within_its_sigma_along_a_slow_turn():
    wall = Wall(np.random.default_rng(3))
    thetas = [STILL] * 4 + [np.array([0.2 * k, -0.1 * k, 0.02 * k, 0]) / F for k in range(16)]
    course = course_of(wall.film(thetas))
    found = turns(wall, course)
    z = [(t.theta - thetas[k]) / np.sqrt(np.diag(t.covariance)) for t, k in zip(found, course.frames, strict=True)]
    assert np.abs(z).max() < 4.5
    assert np.sqrt(np.mean(np.square(z))) < 1.7


def test_a_patch_that_a_target_covers_is_not_used_then():
    wall = Wall(np.random.default_rng(4))
    free = course_of(wall.film([STILL] * 12))
    at = free.middles[3] + [4.0, 0.0]
    course = course_of(wall.film([STILL] * 12), Targets(np.array([11]), at[None], np.array([5.0])))
    same = int(np.linalg.norm(course.middles - free.middles[3], axis=1).argmin())
    assert np.isnan(course.shift[-1, same]).all()
    assert np.isfinite(course.shift[0, same]).all()


def test_targets_at_the_beginning_give_no_patch():
    wall = Wall(np.random.default_rng(5))
    at = np.array([[160.0, 120.0]])
    course = course_of(wall.film([STILL] * 6), Targets(np.array([0]), at, np.array([40.0])))
    assert np.abs(course.middles - at).max(1).min() > 40


def test_a_plain_wall_has_no_course():
    wall = Wall(np.random.default_rng(6), contrast=0.0)
    assert course_of(wall.film([STILL] * 6)).middles.shape == (0, 2)


def test_no_frames_have_no_course():
    assert not len(course_of([], NO_TARGETS).frames)


def test_large_pictures_are_reduced_and_shifts_are_those_of_the_recording():
    wall, turned = Wall(np.random.default_rng(7), grain=4.0), np.array([0.0, 4, 0, 0]) / F
    course = course_of(wall.film([STILL] * 5 + [turned] * 5), pixels=20_000)
    assert np.nanmedian(course.shift[-1, :, 0]) == pytest.approx(4, abs=0.15)


def test_places_outside_the_picture_cover_nothing():
    mask = covered((20, 10), np.array([[-50.0, 5], [5, 5], [np.nan, np.nan]]), np.array([3.0, 1, 2]))
    assert mask.sum() == 9
    assert mask[4:7, 4:7].all()


def test_rows_are_those_of_frames_in_which_targets_were_tracked():
    frames, n = np.array([0, 3, 6]), 2
    shift = np.arange(12.0).reshape(3, n, 2)
    columns = Course(np.array([[5.0, 6], [7, 8]]), frames, shift, shift / 10).columns(np.arange(7) / 10, 1, 6)
    assert columns["frame"].tolist() == [3, 3, 6, 6]
    assert columns["patch"].tolist() == [0, 1, 0, 1]
    np.testing.assert_allclose(columns["time_s"], [0.3, 0.3, 0.6, 0.6])
    np.testing.assert_allclose(columns["Yf"], [6, 8, 6, 8])
    np.testing.assert_allclose(columns["dx"], [4, 6, 8, 10])
    np.testing.assert_allclose(columns["sd_y"], [0.5, 0.7, 0.9, 1.1])
