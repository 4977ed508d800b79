"""A dropped ball is located by cameras whose clocks were other ones for the wand."""

import numpy as np
import pytest

from tests.calibration.wand.waved import refined, waved
from vidtrack.calibration.wand.drop import dropped
from vidtrack.calibration.wand.ends import orders, stretches
from vidtrack.calibration.wand.tracks import Follows, Timed
from vidtrack.geometry.camera import project


@pytest.fixture(scope="module")
def rig():
    scene = waved(91, n=150)
    done = refined(scene)
    follows = [Follows(scene.t, own, np.full(own.shape, 0.1), stretches(own)) for own in scene.b]
    return scene, done, Timed(follows, orders(scene.wand.lengths), [])


@pytest.mark.parametrize("late", [0.0, 0.137])
def test_the_fall_is_gravity_whatever_the_clock_of_the_second_camera(rig, late):
    scene, done, timed = rig
    timed.late = (1,) if late else ()
    t = np.arange(40) / 30
    tracks = {}
    for i, (c, shift) in enumerate(zip(scene.cameras, (0.0, late), strict=True)):
        z = 20 - 9.81 / 0.0254 / 2 * np.clip(t + shift - 0.3, 0, 0.35) ** 2
        b = project(c, np.stack([0 * t, 0 * t + 3, z], -1)) + scene.rng.normal(0, 0.1, (40, 2))
        tracks[i] = t, b
    fall = dropped(done, timed, tracks)
    assert np.linalg.norm(fall.acceleration) * 0.0254 == pytest.approx(9.81, abs=max(5 * fall.sd * 0.0254, 0.05))


def test_a_ball_that_no_camera_follows_is_refused(rig):
    _, done, timed = rig
    with pytest.raises(ValueError, match="no camera"):
        dropped(done, timed, {0: (np.arange(3.0), np.zeros((3, 2)))})
