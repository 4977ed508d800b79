"""Poses of a body from located targets, and which moments can be used."""

import numpy as np

from vidtrack.calibration.body.body_sights import Body, BodySights, poses_of, usable
from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import thesis_rig

P = np.array([[14.0, 0, 3], [-9.0, 10, 3], [-9.0, -10, 2], [1.0, 2, 14]])


def _moved(n, rng):
    R = np.stack([rotation_from_vector(v) for v in rng.normal(0, 0.5, (n, 3))])
    t = rng.uniform(-10, 10, (n, 3))
    return R, t, P @ np.swapaxes(R, -1, -2) + t[:, None]


def test_the_pose_is_the_motion_that_moved_the_body_whichever_targets_are_seen():
    rng = np.random.default_rng(0)
    R, t, x = _moved(20, rng)
    good = np.ones(x.shape[:2], bool)
    good[::3, 1] = False
    x[~good] = np.nan
    poses = poses_of(P, x, good)
    np.testing.assert_allclose(poses[..., :3], R, atol=1e-9)
    np.testing.assert_allclose(poses[..., 3], t, atol=1e-9)


def test_targets_on_one_line_give_no_pose():
    line = np.outer(np.arange(3.0), [1, 2, 2])
    assert np.isnan(poses_of(line, line[None], np.ones((1, 3), bool))).all()


def test_a_moment_needs_three_targets_that_two_cameras_see():
    rng = np.random.default_rng(1)
    _, _, x = _moved(6, rng)
    cameras = thesis_rig(2)
    b = np.stack([project(c, x) for c in cameras])
    b[1, 2, :2] = np.nan  # two targets are left to both cameras
    b[0, 4, 0] = np.nan  # three are
    sights, poses = usable(cameras, BodySights(b, np.full(b.shape, 0.1), np.arange(6)), Body(tuple("abcd"), P, 0.01))
    assert sights.run.tolist() == [0, 1, 3, 4, 5]
    assert len(poses) == 5
    assert np.isnan(sights.b[1, 3, 0]).all(), "what one camera alone sees is no sight of the adjustment"
