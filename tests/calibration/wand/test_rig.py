"""Cameras from what they saw of a wand, roughly: good enough that the adjustment finds the rest."""

import numpy as np
import pytest

from tests.calibration.wand.waved import waved
from vidtrack.calibration.wand.ends import jointly, stretches
from vidtrack.calibration.wand.rig import find_rig, located


def _found(scene, b=None):
    b = scene.b if b is None else b
    m = len(scene.cameras)
    each = jointly([stretches(own) for own in b])
    return find_rig(b, each, scene.nominal, scene.wand, [None] * m, np.random.default_rng(0))


@pytest.mark.parametrize("seed", [3, 4])
def test_four_cameras_are_found_whatever_each_calls_the_balls(seed):
    scene = waved(seed, m=4)
    b = scene.b.copy()
    b[1], b[3] = b[1][:, ::-1], b[3][:, ::-1]
    rig = _found(scene, b)
    for found, true in zip(rig.cameras, scene.cameras, strict=True):
        assert found.f == pytest.approx(true.f, rel=0.06)
    length = np.linalg.norm(rig.points[:, 0] - rig.points[:, 1], axis=-1)
    assert np.nanmedian(length) == pytest.approx(20.0, rel=0.01)
    np.testing.assert_allclose(rig.cameras[0].R, np.eye(3), atol=1e-9)
    # the distances between the cameras are those of the rig
    ours = np.linalg.norm(rig.cameras[0].position - rig.cameras[2].position)
    theirs = np.linalg.norm(scene.cameras[0].position - scene.cameras[2].position)
    assert ours == pytest.approx(theirs, rel=0.06)


def test_a_camera_that_is_blind_half_of_the_time_joins_the_others():
    scene = waved(5, m=3)
    b = scene.b.copy()
    b[2, 100:260] = np.nan
    rig = _found(scene, b)
    assert rig.cameras[2].f == pytest.approx(scene.cameras[2].f, rel=0.06)


def test_cameras_that_share_no_moment_are_refused():
    scene = waved(6)
    b = scene.b.copy()
    b[0, 150:], b[1, :150] = np.nan, np.nan
    with pytest.raises(ValueError, match="no two cameras"):
        _found(scene, b)


def test_what_one_camera_alone_sees_is_not_located():
    scene = waved(7, noise=0.0)
    b = scene.b.copy()
    b[1, 4] = np.nan
    p = located(scene.cameras, b)
    assert np.isnan(p[4]).all()
    good = np.isfinite(p).all((-1, -2))
    np.testing.assert_allclose(p[good], scene.ends[good], atol=1e-6)
