"""Every measurement's derivatives are those of what it computes: finite differences are the independent source."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment.measurements import (
    CameraPriors,
    KnownCameras,
    Lengths,
    PointsOf,
    SharedPriors,
    Sights,
    steps_between,
)
from vidtrack.calibration.adjustment.unknowns import (
    State,
    Unknowns,
    free_blocks,
    moved_poses,
    points_of_poses,
    pose_blocks,
)
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, stepped
from vidtrack.simulate.rig import thesis_rig

FREE = free_parameters("tsai")
PIVOT = np.array([2.0, -1.0, 3.0])


def _differences(measurement, state, unknowns, family):
    """What the residuals do, with the sign turned, when each unknown takes a small step."""
    here = measurement.equations(state, unknowns)
    n, d = (len(state.blocks[0]), family.size)
    none = np.zeros((n, d))
    for k, column in enumerate(here.columns):
        step = np.zeros(unknowns.size)
        step[column] = 1e-6
        there = measurement.equations(unknowns.stepped(state, [family], step, [none]), unknowns)
        yield here.by_shared[..., k], (here.residual - there.residual) / 1e-6
    for k in range(d if here.by_block is not None else 0):
        step = none.copy()
        step[:, k] = 1e-6
        there = measurement.equations(unknowns.stepped(state, [family], np.zeros(unknowns.size), [step]), unknowns)
        yield here.by_block[..., k], (here.residual - there.residual) / 1e-6


def _agree(measurement, state, unknowns, family):
    for ours, theirs in _differences(measurement, state, unknowns, family):
        there = np.isfinite(theirs)
        np.testing.assert_allclose(ours[there], theirs[there], rtol=2e-4, atol=2e-3)


def test_sights_and_lengths_of_a_wand():
    rng = np.random.default_rng(1)
    cameras = tuple(thesis_rig(2))
    ends = rng.uniform(-20, 20, (6, 6))
    unknowns = Unknowns([FREE, FREE], PIVOT, ("A-B",))
    state = State(cameras, {"A-B": 10.0}, (ends,))
    b = np.stack([project(cameras[1], ends.reshape(6, 2, 3))])[0]
    b[2, 1] = np.nan
    sights = Sights(1, b, 0.1)
    _agree(sights, state, unknowns, free_blocks(ends))
    assert (sights.weight == 0).sum() == 2
    lengths = Lengths([(0, 1, "A-B")], 6, 0.01)
    _agree(lengths, state, unknowns, free_blocks(ends))
    true = np.linalg.norm(ends[:, 3:] - ends[:, :3], axis=-1)
    np.testing.assert_allclose(lengths.equations(state, unknowns).residual[:, 0], 10 - true)


def test_sights_of_a_body_whose_size_is_a_shared_parameter():
    rng = np.random.default_rng(2)
    cameras = tuple(thesis_rig(2))
    body = rng.normal(0, 5, (4, 3))
    poses = moved_poses(np.tile(np.eye(3, 4), (3, 1, 1)), rng.normal(0, 0.5, (3, 6)))
    unknowns = Unknowns([FREE, FREE], PIVOT, ("scale",))

    def points(state):
        p, J = points_of_poses(state.blocks[0], body * state.shared["scale"])
        return PointsOf(p, J, {"scale": body @ state.blocks[0][..., :3].swapaxes(-1, -2)})

    state = State(cameras, {"scale": 1.1}, (poses,))
    _agree(Sights(0, np.zeros((3, 4, 2)), 1.0, points=points), state, unknowns, pose_blocks(3))


def test_priors_pull_towards_their_mean_and_refuse_what_has_no_zero():
    camera = thesis_rig(1)[0]
    unknowns = Unknowns([FREE], PIVOT, ("length",))
    state = State((camera,), {"length": 3.0}, ())
    told = CameraPriors([{"Cx": (camera.Cx + 5, 0.1), "kappa2": (0.0, 1.0)}]).equations(state, unknowns)
    np.testing.assert_allclose(told.residual, [[5.0]])
    np.testing.assert_allclose(told.weight, [[100.0]])
    assert told.columns.tolist() == [FREE.index("Cx")]
    other = SharedPriors({"length": (2.5, 0.5), "gone": (0.0, 1.0)}).equations(state, unknowns)
    np.testing.assert_allclose((other.residual, other.weight), ([[-0.5]], [[4.0]]))
    with pytest.raises(ValueError, match="no meaning"):
        CameraPriors([{"omega_x": (0.0, 1.0)}])


@pytest.mark.parametrize("seed", range(3))
def test_cameras_known_from_another_calibration_pull_as_its_covariance_says_about_any_pivot(seed):
    rng = np.random.default_rng(seed)
    cameras = thesis_rig(2)
    spread = np.tile([1e-3] * 3 + [0.01] * 3 + [0.02, 1e-4, 0.5, 0.5, 1e-5], 2)
    root = rng.normal(0, 1, (22, 22)) * spread[:, None]
    known = KnownCameras(cameras, [FREE, FREE], PIVOT, root @ root.T)
    other = Unknowns([FREE, FREE], PIVOT + np.array([10.0, 5.0, -3.0]))
    step = dict(zip(PARAMETERS[:6], rng.normal(0, 1e-4, 6), strict=True))
    now = (stepped(cameras[0], PIVOT, step), cameras[1])
    equations = known.equations(State(now, {}, ()), other)
    # the pull is the one of the other calibration's own parameters
    moved = np.concatenate([[*step.values()], np.zeros(16)])
    assert (equations.residual**2).sum() == pytest.approx(moved @ np.linalg.solve(root @ root.T, moved), rel=1e-5)
    found = np.array([steps_between(cameras[0], now[0], PIVOT)[name] for name in PARAMETERS[:6]])
    np.testing.assert_allclose(found, moved[:6], atol=1e-9)
    for ours, theirs in _differences(known, State(now, {}, (np.zeros((1, 3)),)), other, free_blocks(np.zeros((1, 3)))):
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-3 * np.abs(theirs).max())
