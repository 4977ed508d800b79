"""The adjustment of a wand reaches what perfectly known cameras would, and leaves mistakes out."""

import numpy as np
import pytest

from tests.calibration.wand.waved import rigid_error, waved
from vidtrack.calibration.wand.refined import refine_further, refine_wand


def _rough(scene):
    """The cameras a little off, in the first one's axes."""
    R, T = scene.cameras[0].R, scene.cameras[0].T
    moved = [c.with_(R=c.R @ R.T, T=c.T - c.R @ R.T @ T) for c in scene.cameras]
    return [c.with_(f=c.f * 1.01, kappa1=0.0, Sx=1.0) for c in moved]


def _refined(scene, views=None, **more):
    views = views or scene.views
    return refine_wand(_rough(scene), lambda clocks: views, scene.wand, arrange=lambda v: v, **more)


@pytest.mark.parametrize(("seed", "m"), [(11, 2), (12, 4)])
def test_held_out_points_are_located_as_well_as_by_perfect_cameras(seed, m):
    scene = waved(seed, m=m, n=500)
    done = _refined(scene)
    error, floor = rigid_error(done.cameras, scene.cameras, np.random.default_rng(seed))
    assert 0.9 * floor < error < 1.15 * floor
    assert done.model == "tsai"
    assert done.found.factors["px"] * 0.1 == pytest.approx(0.1, rel=0.06)
    assert done.found.converged


def test_a_lens_that_needs_more_terms_gets_them():
    scene = waved(13)
    cameras = [c.with_(kappa2=2e-4, kappa1=2e-3) for c in scene.cameras]
    scene = waved(13, cameras=cameras, n=400)
    done = _refined(scene)
    assert done.model != "tsai"
    error, floor = rigid_error(done.cameras, cameras, np.random.default_rng(0))
    assert error < 1.3 * floor


def test_wrong_sights_are_left_out_and_do_no_harm():
    scene = waved(14)
    b = scene.b.copy()
    b[0, ::20, 0] += 8.0  # one ball in twenty is another thing
    views = scene.views._replace(b=b)
    done = _refined(scene, views, models=("tsai",))
    # two cameras see a mistake across their epipolar lines, and along them where it changes the wand's length
    assert np.isin(done.rows, np.arange(0, 300, 20)).sum() <= 3
    error, floor = rigid_error(done.cameras, scene.cameras, np.random.default_rng(0))
    assert error < 1.2 * floor


def test_a_wand_seen_too_seldom_is_refused():
    scene = waved(15)
    b = scene.b.copy()
    b[0, 15:] = np.nan
    with pytest.raises(ValueError, match="15 moments"):
        _refined(scene, scene.views._replace(b=b))


def test_parameters_that_the_user_fixes_stay():
    scene = waved(16)
    done = _refined(scene, models=("tsai",), fixed=[("f", "Sx"), ()], priors=[{}, {"Cx": (255.5, 1e-3)}])
    assert done.cameras[0].f == _rough(scene)[0].f
    assert done.cameras[1].Cx == pytest.approx(255.5, abs=0.01)
    found, problem = refine_further(
        done, scene.wand, [], [], [], problem_free(done), [{}, {}], done.cameras, done.points
    )
    assert found.cost <= done.found.cost * 1.5
    assert problem.unknowns.free == done.problem.unknowns.free


def problem_free(done):
    return done.problem.unknowns.free
