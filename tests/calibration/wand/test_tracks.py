"""Tracks on common moments, each ball in the place of its end."""

import numpy as np
import pytest

from vidtrack.calibration.wand.measured import Views
from vidtrack.calibration.wand.tracks import Arranged, Follows, Timed


def _follow(t, late=0.0):
    b = np.stack(
        [np.stack([100 + 30 * (t + late), 50 + 0 * t], -1), np.stack([200 - 20 * (t + late), 90 + 0 * t], -1)], 1
    )
    return Follows(t, b, np.full(b.shape, 0.1), np.zeros(len(t), int))


def test_a_camera_whose_clock_is_known_is_sampled_at_the_moments_of_the_first():
    one, other = _follow(np.arange(50) / 25), _follow(np.arange(60) / 30 + 0.01)
    views = Timed([one, other], [(0, 1)], []).sampled(np.zeros(2))
    inside = np.isfinite(views.b[1]).all((-1, -2))
    np.testing.assert_allclose(views.b[1][inside], views.b[0][inside], atol=1e-9)
    assert (views.sd[1][inside] > 0).all()
    assert (views.velocity == 0).all()


def test_velocities_of_a_late_camera_are_those_of_its_balls_when_its_clock_is_changed():
    one, other = _follow(np.arange(200) / 25), _follow(np.arange(200) / 25)
    timed = Timed([one, other], [(0, 1)], [1])
    timed.shift[:] = 0.0
    here, later = timed.sampled(np.zeros(2)), timed.sampled(np.array([0, 0.01]))
    inside = np.isfinite(here.b[1]).all((-1, -2)) & np.isfinite(later.b[1]).all((-1, -2))
    moved = (later.b[1] - here.b[1])[inside] / 0.01
    assert np.median(np.abs(moved - here.velocity[1][inside])) < 1e-6
    assert np.median(here.velocity[1][inside][:, 0, 0]) == pytest.approx(-30)


def test_balls_are_put_where_the_rig_has_them_at_every_moment():
    before = np.arange(16.0).reshape(1, 4, 2, 2)
    after = before.copy()
    after[:, 1] = before[:, 1, ::-1]
    arrange = Arranged([(0, 1), (1, 0)], before, after)
    moved = arrange(Views(before, before + 1, before + 2))
    np.testing.assert_array_equal(moved.b, after)
    assert moved.sd[0, 1, 0, 0] == before[0, 1, 1, 0] + 1
