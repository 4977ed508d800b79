"""Recordings that were started by hand are brought together to a sampling interval."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.clocks.rough_clock import rough_offset
from vidtrack.simulate.rig import thesis_rig

T = np.arange(1200) / 30


def wander(t):
    """A motion that never repeats itself within the run."""
    return np.stack(
        [15 * np.sin(0.3 * t) + 6 * np.sin(1.7 * t), 3 * np.sin(0.53 * t), 4 * np.cos(0.41 * t) + 2 * np.sin(2.3 * t)],
        -1,
    )


def seen(camera, late, seed=0, path=wander):
    b = project(camera, path(T + late)) + np.random.default_rng(seed).normal(0, 0.1, (T.size, 2))
    return np.stack([b, project(camera, path(T + late) * [-0.7, 1, 1] + [0, 2, 3])])


@pytest.mark.parametrize("late", [0.0, 3.37, 12.9, -8.2])
def test_cameras_many_seconds_apart_are_found_whatever_the_order_of_their_tracks(late):
    a, b = thesis_rig(2)
    rough = rough_offset(a, T, seen(a, 0), b, T, seen(b, late, 1)[::-1], 20.0)
    assert rough.offset_s == pytest.approx(late, abs=1 / 30)
    assert rough.px < 3
    assert rough.twins == ()


def test_a_periodic_motion_keeps_the_clock_that_it_has_and_names_the_twins():
    a, b = thesis_rig(2)

    def swing(t):
        return np.stack([20 * np.sin(np.pi * t), 2 * np.cos(np.pi * t), np.cos(np.pi * t)], -1)

    rough = rough_offset(a, T, seen(a, 0, path=swing), b, T, seen(b, 0, 1, path=swing), 7.0)
    assert rough.offset_s == 0
    assert sorted(abs(s) for s in rough.twins)[0] == pytest.approx(2.0, abs=0.05)


def test_what_was_never_seen_gives_no_offset():
    a, b = thesis_rig(2)
    nothing = np.full((1, T.size, 2), np.nan)
    assert rough_offset(a, T, nothing, b, T, seen(b, 0), 5.0).offset_s == 0
    assert np.isnan(rough_offset(a, T, seen(a, 0), b, T, nothing, 5.0).px)
