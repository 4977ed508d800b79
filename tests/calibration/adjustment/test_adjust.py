"""The adjustment finds what made the measurements, how well it knows it, and how large each group's noise is."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment.adjust import Problem, adjust, minimise
from vidtrack.calibration.adjustment.measurements import Lengths, SharedPriors, Sights
from vidtrack.calibration.adjustment.unknowns import Family, State, Unknowns, free_blocks
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig

FREE = free_parameters("tsai", ("Sx",))


def _wand(rng, n, noise, bend=0.0, m=2):
    """A wand of 20 in waved before the thesis's rig; the first camera is known."""
    cameras = tuple(thesis_rig(m))
    middle, along = rng.uniform(-25, 25, (n, 3)), rng.normal(0, 1, (n, 3))
    along *= (20 + rng.normal(0, bend, (n, 1))) / np.linalg.norm(along, axis=-1, keepdims=True) / 2
    ends = np.concatenate([middle - along, middle + along], -1)
    b = [project(camera, ends.reshape(n, 2, 3)) for camera in cameras]
    return cameras, ends, [s + rng.normal(0, noise, s.shape) for s in b]


def _problem(cameras, ends, sights, sd, length_sd, groups, shared=()):
    # the world is where the first camera is: its place is held
    free = [FREE[6:], *[FREE] * (len(cameras) - 1)]
    measured = [Sights(i, b, sd) for i, b in enumerate(sights)]
    noise = "length" if "length" in groups else ""
    lengths = Lengths([(0, 1, "A-B")], len(ends), length_sd, noise=noise)
    unknowns = Unknowns(free, np.zeros(3), shared)
    return Problem(unknowns, [free_blocks(ends)], [*measured, lengths, SharedPriors({"A-B": (20.0, 0.01)})], groups)


def test_a_wand_gives_cameras_and_the_scale_from_a_rough_start():
    rng = np.random.default_rng(0)
    cameras, ends, sights = _wand(rng, 150, 0.0)
    start = tuple(c.with_(f=c.f * 1.03, kappa1=0.0, T=c.T + np.array([0.5 * i, 0, 0])) for i, c in enumerate(cameras))
    problem = _problem(cameras, ends, sights, 0.1, 0.001, {})
    found = adjust(problem, State(start, {"A-B": 20.0}, (ends + rng.normal(0, 0.3, ends.shape),)))
    assert found.converged
    assert max(np.nanmax(np.abs(r)) for r in found.residuals[:3]) < 1e-5
    for ours, true in zip(found.state.cameras, cameras, strict=True):
        assert ours.f == pytest.approx(true.f, rel=1e-6)
    np.testing.assert_allclose(found.state.blocks[0], ends, atol=1e-5)


def test_each_group_has_the_noise_that_its_residuals_show_and_normalised_residuals_have_unit_variance():
    rng = np.random.default_rng(1)
    cameras, ends, sights = _wand(rng, 400, 0.04, bend=0.05)
    problem = _problem(cameras, ends, sights, 0.1, 0.02, {"px": 1e-3, "length": 1e-3})
    found = adjust(problem, State(cameras, {"A-B": 20.0}, (ends,)))
    assert found.factors["px"] * 0.1 == pytest.approx(0.04, rel=0.1)
    assert found.factors["length"] * 0.02 == pytest.approx(0.05, rel=0.15)
    for each in found.normalised[:3]:
        assert np.nanstd(each) == pytest.approx(1.0, abs=0.15)


def test_covariances_of_all_cameras_together_are_those_of_many_trials():
    rng = np.random.default_rng(2)
    errors, shares = [], []
    cameras, ends, _ = _wand(rng, 60, 0.0)
    clean = [project(c, ends.reshape(60, 2, 3)) for c in cameras]
    for _ in range(40):
        sights = [s + rng.normal(0, 0.1, s.shape) for s in clean]
        found = adjust(_problem(cameras, ends, sights, 0.1, 1e-4, {}), State(cameras, {"A-B": 20.0}, (ends,)))
        names = found.state.cameras
        errors.append([names[0].f - cameras[0].f, names[1].f - cameras[1].f])
        k = [FREE[6:].index("f"), len(FREE[6:]) + FREE.index("f")]
        shares.append(found.covariance[np.ix_(k, k)])
    told, scatter = np.mean(shares, 0), np.cov(np.transpose(errors))
    assert np.sqrt(np.diag(scatter)) == pytest.approx(np.sqrt(np.diag(told)), rel=0.35)
    assert np.corrcoef(np.transpose(errors))[0, 1] == pytest.approx(
        told[0, 1] / np.sqrt(told[0, 0] * told[1, 1]), abs=0.3
    )


def test_a_shared_length_is_found_where_points_are_surveyed():
    """A wand said to be 20 long is 20.5: surveyed points give the scale, and the wand's length follows."""
    rng = np.random.default_rng(3)
    cameras, ends, sights = _wand(rng, 100, 0.05)
    p = rng.uniform(-25, 25, (12, 3))
    more = [
        Sights(i, project(c, p)[:, None] + rng.normal(0, 0.05, (12, 1, 2)), 0.05, family=1)
        for i, c in enumerate(cameras)
    ]
    lengths = Lengths([(0, 1, "A-B")], 100, 0.001)
    problem = Problem(
        Unknowns([FREE] * 2, np.zeros(3), ("A-B",)),
        [free_blocks(ends), Family(3, p, np.full(p.shape, np.inf))],
        [*(Sights(i, b, 0.05) for i, b in enumerate(sights)), *more, lengths],
    )
    found = adjust(problem, State(cameras, {"A-B": 20.5}, (ends, p)))
    sigma = np.sqrt(found.covariance[-1, -1])
    assert sigma < 0.02
    assert abs(found.state.shared["A-B"] - 20.0) < 4 * sigma


def test_refits_without_covariance_end_where_the_whole_adjustment_ends():
    rng = np.random.default_rng(4)
    cameras, ends, sights = _wand(rng, 60, 0.1)
    problem = _problem(cameras, ends, sights, 0.1, 1e-3, {})
    start = State(cameras, {"A-B": 20.0}, (ends,))
    assert minimise(problem, start).cameras[1].f == pytest.approx(adjust(problem, start).state.cameras[1].f, rel=1e-7)


def test_what_leaves_the_scale_open_is_refused():
    rng = np.random.default_rng(5)
    cameras, ends, sights = _wand(rng, 60, 0.1)
    problem = _problem(cameras, ends, sights, 0.1, 1e-3, {})
    without = problem._replace(measurements=[m for m in problem.measurements if isinstance(m, Sights)])
    with pytest.raises(ValueError, match="open"):
        adjust(without, State(cameras, {"A-B": 20.0}, (ends,)))
