"""What an error of one camera's pixels leaves in the residuals of located points."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.sight_system import left_by, root_of, sight_system
from vidtrack.simulate.rig import thesis_rig


def system_of(moved=(0.0, 0.0)):
    rng = np.random.default_rng(4)
    cameras, p = thesis_rig(2), rng.uniform(-10, 10, (20, 3))
    b = np.stack([project(c, p) + np.asarray(moved) * (i == 1) for i, c in enumerate(cameras)])[:, None]
    located = locate_points(cameras, b, sd=np.full(b.shape, 0.05))
    on = np.ones((2, 20), bool)
    args = located, np.zeros(20, np.intp), np.arange(20), on, np.full(b.shape, 0.05)
    return cameras, p, sight_system(cameras, located.point[0], *args)


def test_a_shift_of_the_points_leaves_nothing():
    cameras, p, system = system_of()
    shift = np.array([0.1, -0.2, 0.05])
    px = [derivatives(c, p, c.position, ()).by_point @ shift for c in cameras]
    left = sum(left_by(system, i, own[..., None]) for i, own in enumerate(px))
    assert np.abs(left).max() < 1e-3 < np.abs(left_by(system, 0, px[0][..., None])).max()


def test_a_shift_of_a_camera_leaves_the_residuals_that_it_makes():
    _, p, system = system_of((0.0, 0.3))
    px = np.broadcast_to([0.0, 0.3], (len(p), 2))
    assert system.e == pytest.approx(left_by(system, 1, px[..., None])[..., 0], abs=0.02)
    assert np.abs(system.e).max() > 1


def test_a_singular_covariance_has_a_root():
    C = np.outer([1.0, 2e-6, 3e4], [1.0, 2e-6, 3e4])
    assert root_of(C) @ root_of(C).T == pytest.approx(C, rel=1e-6)
