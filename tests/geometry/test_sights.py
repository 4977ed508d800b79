"""Lines of sight and the points of least squares: against the equations written out, numpy's lstsq and differences."""

import numpy as np
import pytest

from vidtrack.geometry.camera import line_of_sight, project
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.sights import (
    carried_noise,
    linear_gain,
    linear_point,
    look_back,
    refined_gain,
    refined_point,
    sight,
)
from vidtrack.geometry.symmetric import full
from vidtrack.simulate.rig import thesis_rig

LENS = {"kappa1": 2e-3, "kappa2": 2e-5, "p1": 5e-4, "p2": -4e-4, "skew": 0.02, "s1": 1e-4}
ORIGIN = np.array([3.0, -2.0, 1.0])


def rig(n=3):
    return [camera.with_(**LENS) for camera in thesis_rig(n)]


def targets(n=6, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * (25, 6, 9)


def sights_of(cameras, b, weight=1.0, used=True):
    n = b.shape[1]
    return [
        sight(camera, seen, np.full((n, 2), weight), np.full(n, used), ORIGIN)
        for camera, seen in zip(cameras, b, strict=True)
    ]


def seen(cameras, p, noise=0.0):
    b = np.stack([project(camera, p) for camera in cameras])
    return b + np.random.default_rng(9).normal(0, noise, b.shape)


def test_tangents_are_those_of_the_line_of_sight():
    camera = rig()[0]
    b = project(camera, targets())
    s = sight(camera, b, np.ones((6, 2)), np.ones(6, bool), ORIGIN)
    direction = line_of_sight(camera, b)[1] @ camera.R.T
    np.testing.assert_allclose(s.uv.T, direction[:, :2] / direction[:, 2:], atol=1e-12)
    np.testing.assert_allclose(s.t, camera.R @ ORIGIN + camera.T)
    assert s.used.all()


def test_px_is_how_the_picture_follows_the_tangents():
    camera = rig()[0]
    b = project(camera, targets())
    s = sight(camera, b, np.ones((6, 2)), np.ones(6, bool), ORIGIN)
    h = 1e-6
    for k in range(2):
        moved = s.uv.T + h * np.eye(2)[k]
        back = s.uv.T - h * np.eye(2)[k]
        in_front = [np.column_stack([uv, np.ones(6)]) @ camera.R + camera.position for uv in (moved, back)]
        by_tangent = (project(camera, in_front[0]) - project(camera, in_front[1])) / (2 * h)
        np.testing.assert_allclose(s.px[:, k].T, by_tangent, rtol=1e-6, atol=1e-4)


def test_what_is_not_measured_or_not_used_weighs_nothing_and_is_no_nan():
    camera = rig()[0]
    b = project(camera, targets())
    b[1] = np.nan
    s = sight(camera, b, np.full((6, 2), 4.0), np.array([True] * 5 + [False]), ORIGIN)
    np.testing.assert_array_equal(s.on, [1, 0, 1, 1, 1, 0])
    np.testing.assert_array_equal(s.weight, np.tile([4.0, 0, 4, 4, 4, 0], (2, 1)))
    np.testing.assert_array_equal(s.seen, [True, False, True, True, True, True])
    for values in (s.uv, s.d, s.px, s.weight):
        assert np.isfinite(values).all()
        assert not values[..., 1].any()


def test_the_linear_point_is_numpy_s_least_squares_of_the_thesis_s_equations():
    """(r1 - u r7) x + (r2 - u r8) y + (r3 - u r9) z = u Tz - Tx, and the same with v (4.3.8, 4.3.9)."""
    cameras, p = rig(), targets()
    b = seen(cameras, p, noise=0.5)
    found, Q = linear_point(sights_of(cameras, b))
    for i in range(len(p)):
        A, B = [], []
        for camera, s in zip(cameras, sights_of(cameras, b), strict=True):
            (u, v), R, T = s.uv[:, i], camera.R, camera.T
            A += [R[0] - u * R[2], R[1] - v * R[2]]
            B += [u * T[2] - T[0], v * T[2] - T[1]]
        A, B = np.array(A), np.array(B)
        np.testing.assert_allclose(found[:, i] + ORIGIN, np.linalg.lstsq(A, B, rcond=None)[0], atol=1e-9)
        np.testing.assert_allclose(full(Q)[i], np.linalg.inv(A.T @ A), rtol=1e-9)


def test_a_camera_that_is_not_used_does_not_move_the_point():
    cameras, p = rig(), targets()
    b = seen(cameras, p)
    three = sights_of(cameras, b + np.array([0, 0, 40.0])[:, None, None])
    three[2] = sight(cameras[2], b[2] + 40, np.ones((6, 2)), np.zeros(6, bool), ORIGIN)
    np.testing.assert_allclose(linear_point(three)[0].T + ORIGIN, p, atol=1e-9)
    np.testing.assert_allclose(refined_point(three, (p - ORIGIN).T + 2, 10)[0].T + ORIGIN, p, atol=1e-4)


def test_refinement_ends_at_the_point_and_its_information_is_that_of_the_projection():
    cameras, p = rig(), targets()
    weights = (1 / 0.1**2, 1 / 0.3**2, 1 / 0.2**2)
    b = seen(cameras, p)
    n = len(p)
    sights = [
        sight(camera, at, np.full((n, 2), w), np.ones(n, bool), ORIGIN)
        for camera, at, w in zip(cameras, b, weights, strict=True)
    ]
    found, Q, rows = refined_point(sights, (p - ORIGIN).T + np.array([[4.0], [-3], [2]]), 10)
    np.testing.assert_allclose(found.T + ORIGIN, p, atol=1e-6)
    by_point = [derivatives(camera, p, np.zeros(3)).by_point for camera in cameras]
    information = sum(w * np.swapaxes(J, 1, 2) @ J for w, J in zip(weights, by_point, strict=True))
    np.testing.assert_allclose(full(Q), np.linalg.inv(information), rtol=1e-4)
    for row, J in zip(rows, by_point, strict=True):
        np.testing.assert_allclose(np.stack(row, 1).T, np.swapaxes(J, 1, 2).swapaxes(1, 2), rtol=1e-4, atol=1e-4)


def test_one_step_is_one_step():
    cameras, p = rig(), targets()
    sights = sights_of(cameras, seen(cameras, p))
    start = (p - ORIGIN).T + 20.0
    once = refined_point(sights, start, 1)[0]
    twice = refined_point(sights, start, 2)[0]
    np.testing.assert_allclose(refined_point(sights, once, 1)[0], twice, atol=1e-12)
    off = [np.abs(each.T + ORIGIN - p).max() for each in (start, once, twice)]
    assert off[0] > 5 * off[1] > 25 * off[2]


@pytest.mark.parametrize("refined", [True, False])
def test_the_gain_is_how_the_point_follows_each_pixel(refined):
    cameras, p = rig(), targets()
    b = seen(cameras, p)
    sights = sights_of(cameras, b)
    at, Q = linear_point(sights)
    if refined:
        at, Q, rows = refined_point(sights, at, 10)
        gains = [refined_gain(s, r, Q) for s, r in zip(sights, rows, strict=True)]
    else:
        gains = [linear_gain(s, at, Q) for s in sights]
    h = 1e-3
    for i in range(3):
        for k in range(2):
            ends = []
            for sign in (1, -1):
                moved = b.copy()
                moved[i, :, k] += sign * h
                other = sights_of(cameras, moved)
                end = linear_point(other)[0]
                ends.append(refined_point(other, end, 10)[0] if refined else end)
            np.testing.assert_allclose(gains[i][k], (ends[0] - ends[1]) / (2 * h), rtol=1e-3, atol=1e-6)


def test_noise_is_carried_by_the_gains():
    cameras, p = rig(2), targets()
    sights = sights_of(cameras, seen(cameras, p), weight=1 / 0.2**2)
    at, Q = linear_point(sights)
    gains = [linear_gain(s, at, Q) for s in sights]
    S = full(carried_noise(sights, gains))
    for i in range(len(p)):
        G = np.concatenate([gain[:, :, i] for gain in gains]).T
        np.testing.assert_allclose(S[i], 0.2**2 * G @ G.T, rtol=1e-9)


def test_what_is_not_used_carries_no_noise():
    cameras, p = rig(), targets()
    sights = sights_of(cameras, seen(cameras, p))
    sights[2] = sight(cameras[2], seen(cameras, p)[2], np.ones((6, 2)), np.zeros(6, bool), ORIGIN)
    at, Q = linear_point(sights)
    gains = [linear_gain(s, at, Q) for s in sights]
    assert not gains[2].any()
    with np.errstate(divide="ignore"):
        assert np.isfinite(carried_noise(sights, gains)).all()


def test_looking_back_gives_pixel_error_depth_and_distance_from_the_line():
    camera, p = rig()[0], targets()
    off = np.random.default_rng(1).normal(0, 0.05, p.shape)
    b = project(camera, p)
    s = sight(camera, b, np.ones((6, 2)), np.ones(6, bool), ORIGIN)
    view = look_back(s, (p + off - ORIGIN).T)
    np.testing.assert_allclose(view.error.T, b - project(camera, p + off), atol=2e-3)
    np.testing.assert_allclose(view.depth, ((p + off) @ camera.R.T + camera.T)[:, 2], rtol=1e-12)
    centre, direction = line_of_sight(camera, b)
    across = np.cross(p + off - centre, direction)
    np.testing.assert_allclose(view.off2, (across**2).sum(1), rtol=1e-9)
