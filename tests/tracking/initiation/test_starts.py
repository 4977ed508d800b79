"""Where targets begin: in boxes, on trails with a velocity, or later."""

import numpy as np
import pytest

from tests.tracking.initiation.test_trails import trail
from tests.tracking.test_tracker import DETECTION, circle, samples_of
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.initiation.starts import late_comers, starts_in_boxes, starts_of_trails
from vidtrack.tracking.initiation.trails import Trail
from vidtrack.tracking.state import NEVER, present
from vidtrack.tracking.tracker import Tracker


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
