"""Where the world's axes lie: every way of naming them gives the axes that were there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.calibration.wand.waved import waved
from vidtrack.calibration.wand.axes import falling, fitted, from_directions, moved, moved_points, normal_of
from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector


@settings(max_examples=20, deadline=None)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3), shift=st.tuples(*[st.floats(-100, 100)] * 3), scale=st.floats(0.5, 2))
def test_points_are_brought_back_by_the_motion_that_moved_them(turn, shift, scale):
    rng = np.random.default_rng(0)
    p = rng.uniform(-10, 10, (6, 3))
    q = scale * p @ rotation_from_vector(turn).T + np.array(shift)
    motion = fitted(p, q, with_scale=True)
    np.testing.assert_allclose(moved_points(p, motion), q, atol=1e-8)
    assert motion.scale == pytest.approx(scale)


def test_points_on_a_line_or_two_points_leave_the_axes_open():
    line = np.outer(np.arange(5.0), [1, 2, 3])
    with pytest.raises(ValueError, match="line"):
        fitted(line, line)
    with pytest.raises(ValueError, match="need 3"):
        fitted(line[:2], line[:2])


def test_an_upright_is_kept_exactly_and_x_as_nearly_as_it_can():
    R = rotation_from_vector([0.3, -0.7, 0.2])
    up, x = R.T @ [0, 0, 2.0], R.T @ [3.0, 0, 0.5]  # the line along x is not quite level
    motion = from_directions(np.array([1.0, 2, 3]), up=up, x=x, heading=np.eye(3)[0])
    np.testing.assert_allclose(motion.R, R, atol=1e-12)
    np.testing.assert_allclose(moved_points(np.array([1.0, 2, 3]), motion), 0, atol=1e-12)
    by_y = from_directions(np.zeros(3), up=up, y=R.T @ [0, 5.0, 0], heading=np.eye(3)[0])
    np.testing.assert_allclose(by_y.R, R, atol=1e-12)
    frame = from_directions(np.zeros(3), x=R.T @ [1.0, 0, 0], y=R.T @ [0.3, 1.0, 0], heading=np.eye(3)[0])
    np.testing.assert_allclose(frame.R, R, atol=1e-12)


def test_one_direction_alone_but_up_and_two_along_one_line_are_refused():
    with pytest.raises(ValueError, match="both x and y"):
        from_directions(np.zeros(3), x=np.array([1.0, 0, 0]), heading=np.eye(3)[0])
    with pytest.raises(ValueError, match="same line"):
        from_directions(np.zeros(3), up=np.array([0, 0, 1.0]), x=np.array([0, 0, 2.0]), heading=np.eye(3)[0])


def test_a_level_surface_has_its_normal_on_the_side_of_the_cameras():
    rng = np.random.default_rng(1)
    p = np.column_stack([rng.uniform(-5, 5, (6, 2)), np.zeros(6)])
    np.testing.assert_allclose(normal_of(p, np.array([0, 0, 40.0])), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(normal_of(p, np.array([0, 0, -40.0])), [0, 0, -1], atol=1e-12)
    with pytest.raises(ValueError, match="line"):
        normal_of(np.outer(np.arange(4.0), [1, 1, 0]), np.ones(3))


def test_a_dropped_ball_gives_gravity_and_one_that_is_held_and_lands_is_used_only_while_it_falls():
    rng = np.random.default_rng(2)
    t = np.arange(90) / 30
    fall = np.clip(t - 1.0, 0, 0.6)
    p = np.stack([0.2 * fall, 0 * t, 1.5 - 9.81 / 2 * fall**2], -1) + rng.normal(0, 0.002, (90, 3))
    found = falling(t, p, np.full(p.shape, 0.002))
    assert np.linalg.norm(found.acceleration) == pytest.approx(9.81, abs=4 * found.sd)
    assert found.sd < 0.3
    assert found.acceleration[2] < -9
    with pytest.raises(ValueError, match="falls"):
        falling(t, np.zeros((90, 3)) + rng.normal(0, 0.002, (90, 3)), np.full((90, 3), 0.002))


def test_cameras_see_moved_points_where_they_saw_the_points():
    scene = waved(41, n=10)
    motion = fitted(scene.ends[:, 0], 1.7 * scene.ends[:, 0] @ rotation_from_vector([1.0, 0, 0.3]) + 5, with_scale=True)
    for before, after in zip(scene.cameras, moved(scene.cameras, motion), strict=True):
        np.testing.assert_allclose(
            project(after, moved_points(scene.ends, motion)), project(before, scene.ends), atol=1e-8
        )
