import numpy as np
import pytest

from tests.location.one_camera.test_plane import grid, seen
from vidtrack.location.one_camera.tilt import tilt

SIZE = (512, 480)


@pytest.mark.parametrize("angle", [8.0, 15.0, 30.0])
def test_a_lean_is_told_within_its_own_uncertainty(angle):
    p = grid()
    b = seen(p, tilt_deg=angle) + np.random.default_rng(5).normal(0, 0.1, (20, 2))
    told = tilt(b, p, image_size=SIZE)
    assert abs(told.angle - angle) < 0.07 * angle + 0.3
    assert abs(told.angle - angle) < 3 * told.sd
    assert told.sd < 6


def test_a_plane_that_faces_the_camera_does_not_lean():
    p = grid()
    told = tilt(seen(p) + np.random.default_rng(6).normal(0, 0.1, (20, 2)), p, image_size=SIZE)
    assert told.angle < 1


def test_pixels_that_are_not_square_do_not_look_like_a_lean():
    p = grid()
    b = seen(p) / [1.25, 1] + np.random.default_rng(7).normal(0, 0.1, (20, 2))
    assert tilt(b, p, aspect=1.25, image_size=(410, 480)).angle < 1


def test_points_on_a_line_say_nothing():
    p = np.column_stack([np.arange(6.0), np.zeros(6)])
    assert np.isnan(tilt(seen(p), p).angle)
    assert np.isnan(tilt(seen(grid())[:3], grid()[:3]).angle)
