"""Where targets begin: in boxes, on trails with a velocity, before their first sample, or later."""

import numpy as np
import pytest

from tests.tracking.test_tracker import DETECTION, circle, samples_of, starts_at
from tests.tracking.test_trails import trail
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.starts import followed_backwards, late_comers, starts_in_boxes, starts_of_trails, with_earlier
from vidtrack.tracking.state import MERGED, NEVER, RECOVERED, Rows, present
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.trails import Trail
from vidtrack.tracking.windows import Windows


def test_a_box_is_a_place_and_a_size_and_nothing_else_is_known():
    starts = starts_in_boxes(np.array([[10.0, 20, 30, 40], [1.0, 2, 3, 4]]))
    np.testing.assert_array_equal(starts.position, [[10, 20], [1, 2]])
    np.testing.assert_array_equal(starts.box, [[30, 40], [3, 4]])
    assert (starts.first == 0).all()
    for name in ("velocity", "acceleration", "pixels", "contrast", "background", "size"):
        assert np.isnan(getattr(starts, name)).all(), name


@pytest.mark.parametrize("gap", [1, 3])
def test_a_parabola_gives_velocity_and_acceleration_whatever_the_steps_between_its_samples(gap):
    k = np.array([0, 1, 1 + gap, 2 + gap])
    position = np.stack([10 + 3.0 * k + 0.5 * k**2, 20 - k], axis=-1).astype(float)
    one = Trail(4 + k, position, np.full(4, 50.0), np.full(4, 150.0), np.full((4, 2), 8.0), np.ones(4))
    starts = starts_of_trails([one], 1, (50.0, 40.0))
    np.testing.assert_allclose(starts.velocity, [[3, -1]])
    np.testing.assert_allclose(starts.acceleration, [[1, 0]], atol=1e-12)
    assert starts.first.tolist() == [4]
    np.testing.assert_array_equal(starts.position, position[:1])
    np.testing.assert_array_equal(starts.box, [[50, 40]])


def test_a_trail_of_two_has_no_velocity_and_what_was_not_seen_no_place():
    starts = starts_of_trails([trail([10, 12])], 3, (50.0, 50.0))
    assert np.isnan(starts.velocity).all()
    assert starts.first.tolist() == [0, NEVER, NEVER]
    assert np.isnan(starts.position[1:]).all()
    assert starts.pixels[0] == 50


def test_the_size_of_a_trail_is_that_of_its_larger_samples():
    """Where it hardly moved at first, its own place in the background hid part of it."""
    one = trail([10, 12, 14, 16, 18], pixels=[10.0, 20, 40, 50, 50])
    assert starts_of_trails([one], 1, (50.0, 50.0)).pixels[0] == 50


def test_samples_before_a_target_s_own_first_are_followed_backwards():
    path = circle(20, 1, period=40.0)
    samples = samples_of(path)
    begun = starts_at(path[6])
    begun = begun._replace(
        first=np.array([6]), velocity=(path[7] - path[5]) / 2, acceleration=path[7] - 2 * path[6] + path[5]
    )
    ((target, rows),) = followed_backwards(samples, begun, DETECTION, 100.0, None, Windows(1))
    assert target == 0
    assert rows.flag.shape == (6, 1)
    assert np.abs(rows.values[:2, :, 0].T - path[:6, 0]).max() < 0.1
    never = begun._replace(first=np.array([NEVER]))
    assert followed_backwards(samples, never, DETECTION, 100.0, None, Windows(1)) == []
    assert followed_backwards(samples, starts_at(path[0]), DETECTION, 100.0, None, Windows(1)) == []


def test_what_was_followed_backwards_stands_before_and_is_no_recovery():
    def rows(n, value, flag=0):
        return Rows(np.full((13, n, 2), value), np.full((n, 2, 2), value), np.full((n, 2), flag), np.zeros(n))

    one = Rows(*(a[..., :1] if a.ndim > 1 and i != 1 else a for i, a in enumerate(rows(2, 7.0, RECOVERED))))
    one = one._replace(corner=np.full((2, 1, 2), 7.0))
    whole = rows(5, 1.0)
    joined = with_earlier(whole, [(1, one)])
    assert (joined.values[:, :2, 1] == 7).all()
    assert (joined.values[:, 2:] == 1).all()
    assert (joined.values[..., 0] == 1).all()
    assert (joined.corner[:2, 1] == 7).all()
    assert not (joined.flag & RECOVERED).any()
    assert (whole.values == 1).all()


def test_where_a_target_was_followed_back_onto_another_neither_is_measured():
    def rows(n, x):
        values = np.full((13, n, len(x)), 100.0)
        values[0] = x
        return Rows(values, np.zeros((n, len(x), 2)), np.zeros((n, len(x)), np.int64), np.zeros(n))

    whole = rows(5, [50.0, np.nan, 90.0])
    whole.values[:, :2, 1] = np.nan
    back = rows(2, [50.3])
    back.values[0, 0] = 65.0  # in the sample before it is apart
    joined = with_earlier(whole, [(1, back)])
    measured = np.isfinite(joined.values[0])
    assert measured[:, 0].tolist() == [True, False, True, True, True]
    assert measured[:2, 1].tolist() == [True, False]
    assert measured[:, 2].all()
    assert (joined.flag[1, :2] & MERGED > 0).all()
    assert not joined.flag[[0, 2, 3, 4]].any()


def test_a_target_that_comes_later_takes_the_place_that_waits_for_it():
    late = circle(30, 1, period=40.0)
    late[:14] = np.nan
    still = np.tile([[[250.0, 30.0]]], (30, 1, 1)) + np.arange(30)[:, None, None] * [0.5, 0.0]
    samples = samples_of(np.concatenate([still, late], axis=1))
    backgrounds = background_of(samples[:12], DETECTION)
    starts = starts_of_trails([trail([250, 250.5, 251], y=30.0)], 2, (50.0, 50.0))
    tracker = Tracker(starts, DETECTION, 100.0)
    tracker.follow(samples[:20])
    tracker.finish()
    assert late_comers(tracker, samples[:20], backgrounds, DETECTION, [1]) == []
    tracker.follow(samples[20:])
    tracker.finish()
    rows = tracker.rows()
    assert present(rows)[20:, 1].all()
    assert np.nanmax(np.abs(rows.values[:2, 20:, 1].T - late[20:, 0])) < 0.1


def test_a_target_that_is_followed_already_is_no_late_comer():
    path = circle(20, 1, period=40.0)
    samples = samples_of(path)
    backgrounds = background_of(samples, DETECTION)
    starts = starts_of_trails([trail([0, 0, 0])._replace(position=path[:3, 0])], 2, (50.0, 50.0))
    tracker = Tracker(starts, DETECTION, 100.0)
    tracker.follow(samples)
    tracker.finish()
    assert late_comers(tracker, samples, backgrounds, DETECTION, [1]) == [1]
    assert late_comers(tracker, samples[:2], backgrounds, DETECTION, [1]) == [1]
