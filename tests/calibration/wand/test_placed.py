"""The rig in the world's axes, by surveyed points or by directions, with what is uncertain of them."""

import numpy as np
import pytest

from tests.calibration.wand.waved import refined, waved
from vidtrack.calibration.wand.placed import PICK_SD, Marks, placed, same_unit
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points

MARKS = {"hook": (0, 0, 25), "bob": (0, 0, 0), "left": (-20, 0, 0), "right": (20, 0, 0), "far": (0, 22, 0)}


@pytest.fixture(scope="module")
def rig():
    scene = waved(51, n=250)
    return scene, refined(scene)


def _marks(scene, rng, noise, sigma=None, scale=1.0):
    p = np.array(list(MARKS.values()), float)
    seen = np.stack([project(c, p) for c in scene.cameras]) + rng.normal(0, noise, (len(scene.cameras), len(p), 2))
    sd = np.full(seen.shape, max(noise, 0.05))
    if sigma is None:
        return Marks(tuple(MARKS), seen, sd)
    return Marks(tuple(MARKS), seen, sd, scale * (p + rng.normal(0, sigma, p.shape)), np.full(len(p), sigma))


def _normalised(scene, at, rng):
    q = rng.uniform(-15, 15, (40, 3))
    s = np.stack([project(c, q) for c in scene.cameras]) + rng.normal(0, 0.1, (len(scene.cameras), 40, 2))
    found = locate_points(at.cameras, s, sd=0.1, uncertainties=_known(at), joint=at.joint)
    return np.einsum("na,nab,nb->n", found.point - q, np.linalg.inv(found.covariance), found.point - q) / 3


def _known(at):
    from vidtrack.calibration.adjustment.unknowns import columns
    from vidtrack.calibration.camera.refine import Uncertainty

    places = [place for place, _ in columns(at.free)]
    return [Uncertainty(n, at.pivot, at.joint[p, p]) for n, p in zip(at.free, places, strict=True)]


@pytest.mark.parametrize(
    "axes",
    [
        {"origin": "bob", "up": ["bob", "hook"], "x": ["left", "right"]},
        {"origin": "bob", "x": ["bob", "right"], "y": ["bob", "far"]},
        {"origin": "bob", "level": ["left", "right", "far", "bob"], "x": ["left", "right"]},
    ],
)
def test_sigma_holds_what_the_picks_of_the_axes_may_be_off(rig, axes):
    scene, done = rig
    rng = np.random.default_rng(1)
    each = []
    for _ in range(12):
        at = placed(done, scene.wand, picked=_marks(scene, rng, PICK_SD), axes=axes)
        each.append(_normalised(scene, at, rng).mean())
    assert 0.4 < np.mean(each) < 2.0  # 12 draws of the axes, one of the rig


def test_surveyed_points_give_the_axes_and_their_covariance(rig):
    scene, done = rig
    rng = np.random.default_rng(2)
    at = placed(done, scene.wand, surveyed=_marks(scene, rng, 0.1, sigma=0.02))
    assert at.axes.kind == "points"
    assert at.axes.motion.scale == pytest.approx(1.0, abs=5 * at.axes.motion.scale_sd)
    assert 0.2 < _normalised(scene, at, rng).mean() < 3.0
    assert len(at.free[0]) == len(at.free[1])
    exact = placed(done, scene.wand, surveyed=_marks(scene, rng, 0.1, sigma=0.0))
    assert np.abs(exact.cameras[0].position - scene.cameras[0].position).max() < 0.5


def test_points_in_another_unit_than_the_wand_show(rig):
    scene, done = rig
    at = placed(done, scene.wand, surveyed=_marks(scene, np.random.default_rng(3), 0.1, sigma=0.01, scale=1.05))
    assert at.axes.motion.scale == pytest.approx(1.05, abs=0.01)
    assert not same_unit(at.axes.motion, scene.wand)
    # the points then set the scale
    assert np.linalg.norm(at.points[:, 0] - at.points[:, 1], axis=-1).mean() == pytest.approx(21.0, abs=0.1)


def test_without_anything_the_axes_are_those_of_the_first_camera(rig):
    scene, done = rig
    for axes, explicit in ((None, False), ("camera", True)):
        at = placed(done, scene.wand, axes=axes)
        assert at.axes.kind == "camera"
        assert at.axes.explicit == explicit
        np.testing.assert_allclose(at.cameras[0].R, np.eye(3), atol=1e-9)
        assert len(at.joint) == sum(map(len, at.free))


def test_axes_that_stay_open_are_refused(rig):
    scene, done = rig
    marks = _marks(scene, np.random.default_rng(4), 0.1)
    with pytest.raises(ValueError, match="both x and y"):
        placed(done, scene.wand, picked=marks, axes={"x": ["left", "right"]})
    with pytest.raises(ValueError, match="gone"):
        placed(done, scene.wand, picked=marks, axes={"up": ["bob", "gone"]})
