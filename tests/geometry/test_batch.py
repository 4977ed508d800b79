"""Batches of points: what a block writes, and which answers are a fix."""

import numpy as np
import pytest

from vidtrack.geometry import batch
from vidtrack.geometry.batch import LEAST_DEPTH, Solution, Task
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig


def task(p, cameras=None, sd=0.1, steps=10, most_unsure=0.25, slips=None):
    cameras = cameras or thesis_rig(3)
    b = np.stack([project(camera, p) for camera in cameras])
    return Task(cameras, b, np.full(b.shape, 1 / sd**2), None, slips, steps, most_unsure)


def targets(n, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * (25, 6, 9)


def test_a_block_of_a_solution_is_part_of_it():
    whole = Solution(2, 10)
    part = whole.block(slice(3, 6))
    part.point[:] = 7.0
    part.error[:] = 5.0
    part.chi2[:] = 2.0
    assert (whole.point[:, 3:6] == 7).all()
    assert (whole.error[..., 3:6] == 5).all()
    assert (whole.chi2[3:6] == 2).all()


def test_a_part_solved_again_replaces_that_part_only():
    whole, again = Solution(2, 4), Solution(2, 2)
    for name, value in vars(whole).items():
        value[:] = 1.0
        getattr(again, name)[:] = 2.0
    whole.put(np.array([3, 0]), again)
    for value in vars(whole).values():
        assert (value[..., [0, 3]] == 2).all()
        assert (value[..., [1, 2]] == 1).all()


def test_the_worst_error_is_the_largest_over_its_limit_among_the_cameras_used_and_none_without_a_fix():
    solved = Solution(2, 3)
    solved.point[:] = 0.0
    solved.point[:, 2] = np.nan
    solved.error[:] = np.array([[3.0, 4.0], [6.0, 8.0]])[:, :, None]
    used = np.array([[True, True, True], [True, False, True]])
    limit = np.array([[1.0, 5.0, 1.0], [2.0, 1.0, 1.0]])
    np.testing.assert_array_equal(solved.worst(used, limit), [5, 1, 0])


def test_some_of_a_task_are_those_points():
    p = targets(5)
    slips = np.arange(30.0).reshape(3, 5, 2)
    some = task(p, slips=slips).at(np.array([4, 1]))
    np.testing.assert_array_equal(some.b, task(p).b[:, [4, 1]])
    np.testing.assert_array_equal(some.slips, slips[:, [4, 1]])
    np.testing.assert_allclose(some.solve(np.ones((3, 2), bool)).point.T, p[[4, 1]], atol=1e-9)
    assert task(p).at(np.array([0])).slips is None


def test_points_on_both_sides_of_the_end_of_a_block_are_located(monkeypatch):
    monkeypatch.setattr(batch, "BLOCK", 4)
    for n in (1, 4, 5, 9):
        p = targets(n)
        solved = task(p).solve(np.ones((3, n), bool))
        np.testing.assert_allclose(solved.point.T, p, atol=1e-9)
        np.testing.assert_allclose(solved.miss, 0, atol=1e-8)


def test_the_rms_distance_from_the_lines_is_the_miss_and_chi2_the_weighted_squares():
    cameras = thesis_rig(2)
    p = targets(20)
    exact = task(p, cameras)
    moved = exact._replace(b=exact.b + np.random.default_rng(1).normal(0, 0.5, exact.b.shape))
    solved = moved.solve(np.ones((2, 20), bool))
    error = np.moveaxis(solved.error, 1, -1)
    np.testing.assert_allclose(error, moved.b - np.stack([project(c, solved.point.T) for c in cameras]), atol=2e-3)
    np.testing.assert_allclose(solved.chi2, (error**2).sum((0, 2)) / 0.1**2, rtol=1e-9)
    # two lines: the point lies between them, and each is half of their distance away
    depth = [(solved.point.T @ c.R.T + c.T)[:, 2] for c in cameras]
    assert (solved.miss < 0.5 * np.max(depth, 0) * cameras[0].dx / cameras[0].f * 3).all()
    assert (solved.miss > 0).all()


def test_one_camera_gives_no_fix():
    p = targets(3)
    used = np.array([[True] * 3, [True, False, False], [False, False, True]])
    found = np.isfinite(task(p).solve(used).point).all(0)
    np.testing.assert_array_equal(found, [True, False, True])


def test_a_fix_may_be_as_unsure_as_the_task_allows():
    """sigma as a share of the distance to the nearest camera that is used."""
    cameras = thesis_rig(2)
    p = np.zeros((1, 3))
    used = np.ones((2, 1), bool)
    sigma = np.sqrt(task(p, cameras).solve(used).noise[:3].sum())
    nearest = min(float((camera.R @ p[0] + camera.T)[2]) for camera in cameras)
    for factor, found in ((1.01, True), (0.99, False)):
        solved = task(p, cameras, most_unsure=factor * sigma / nearest).solve(used)
        assert np.isfinite(solved.point).all() == found


def test_what_a_clock_adds_counts_when_it_is_asked_whether_a_fix_is_sure_enough():
    cameras = thesis_rig(2)
    p = np.zeros((1, 3))
    used = np.ones((2, 1), bool)
    slips = np.full((2, 1, 2), 30.0)
    plain = task(p, cameras).solve(used)
    slipped = task(p, cameras, slips=slips).solve(used)
    assert not plain.common.any()
    assert (slipped.common[:3] > 100 * plain.noise[:3]).any()


@pytest.mark.parametrize("steps", [0, 10])
def test_a_point_nearer_to_a_camera_than_a_thousandth_of_the_base_line_is_no_fix(steps):
    cameras = thesis_rig(2)
    base_line = np.linalg.norm(cameras[0].position - cameras[1].position)
    for share, found in ((2.0, True), (0.5, False), (-2.0, False)):
        near = cameras[0].position + share * LEAST_DEPTH * base_line * cameras[0].R[2]
        b = np.stack([[[cameras[0].Cx, cameras[0].Cy]], project(cameras[1], near)[None]])
        one = Task(cameras, b, np.full(b.shape, 1e8), None, None, steps, 1e3)
        assert np.isfinite(one.solve(np.ones((2, 1), bool)).point).all() == found, share
