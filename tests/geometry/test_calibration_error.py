"""What calibration errors add to a located point."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.geometry.test_camera import cameras
from vidtrack.calibration.camera.refine import Uncertainty, free_parameters, refine
from vidtrack.geometry.calibration_error import by_parameter
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, derivatives, stepped
from vidtrack.geometry.sights import sight
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.shared_survey import Survey, joint_covariance
from vidtrack.simulate.rig import thesis_points, thesis_rig

NAMES = ("omega_y", "t_x", "f", "Cx", "kappa1")
STEPS = {"omega_y": 1e-4, "t_x": 0.01, "f": 1e-3, "Cx": 0.05, "kappa1": 1e-6}


@pytest.mark.parametrize("refine", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_a_parameters_error_moves_the_point_as_the_covariance_says(name, refine):
    cameras = thesis_rig(3)
    p = np.array([[10.0, 3, -4], [-20, -5, 6]])
    b = np.stack([project(c, p) for c in cameras])
    pivot = np.array([1.0, 2, 3])
    known = Uncertainty((name,), pivot, np.array([[STEPS[name] ** 2]]))
    wrong = [cameras[0], stepped(cameras[1], pivot, {name: STEPS[name]}), cameras[2]]
    moved = locate_points(wrong, b, sd=0.1, refine=refine).point - p
    plain = locate_points(cameras, b, sd=0.1, refine=refine).covariance
    widened = locate_points(cameras, b, sd=0.1, refine=refine, uncertainties=[None, known, None]).covariance
    assert widened - plain == pytest.approx(moved[:, :, None] * moved[:, None, :], rel=0.02, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(cameras(), st.floats(0.01, 0.5), st.sampled_from([0.0, 1e4]))
def test_tangents_follow_the_parameters_as_pixels_do(camera, wide, shift):
    """For any lens, far off the axis, and wherever the world's origin lies."""
    camera = camera.with_(T=camera.T - camera.R @ np.full(3, shift))
    rng = np.random.default_rng(0)
    c = np.column_stack([rng.uniform(-wide, wide, (9, 2)), np.ones(9)]) * rng.uniform(50, 300, (9, 1))
    p = camera.position + c @ camera.R
    pivot, origin = p.mean(0) + 5, camera.position + 7
    b = project(camera, p)
    s = sight(camera, b, np.ones((9, 2)), np.ones(9, bool), origin)
    tangents = by_parameter(camera, s, (p - origin).T, pivot - origin, PARAMETERS)
    seen = np.isfinite(b).all(-1)
    J = derivatives(camera, p, pivot).by_parameter[seen]
    pixels = np.einsum("ijn,jkn->nik", s.px, tangents)[seen]
    assert pixels == pytest.approx(J, rel=1e-6, abs=1e-7 * np.abs(J).max(initial=1))


@settings(max_examples=15, deadline=None)
@given(st.integers(2, 4), st.integers(0, 1000), st.sampled_from([1.0, 5.0]))
def test_the_covariance_is_that_of_the_whole_jacobian(n, seed, far):
    """G J C J^T G^T with J at the located point: noise apart for each sample, far outside, errors in common."""
    rng = np.random.default_rng(seed)
    cameras = [c.with_(kappa2=-2e-6, p1=1e-4, skew=1e-3) for c in thesis_rig(n)]
    p = rng.uniform(-1, 1, (30, 3)) * (25, 6, 9) * far
    sd = rng.uniform(0.05, 0.3, (n, 30, 2))
    b = np.stack([project(c, p) for c in cameras]) + rng.normal(0, sd)
    b[:, np.abs(b - 256).max((0, 2)) > 600] = np.nan
    pivots = [rng.uniform(-9, 9, 3) for _ in cameras]
    steps = np.array(
        [1e-4] * 3 + [0.02] * 3 + [1e-2, 1e-3, 0.3, 0.3, 1e-5, 1e-7, 1e-5, 1e-5, 1e-4, 1e-9, 1e-5, 1e-5, 1e-5, 1e-5]
    )
    k = len(PARAMETERS)
    root = rng.normal(0, 1, (n * k, n * k)) * np.tile(steps, n)[:, None]
    C = root @ root.T / (n * k)
    known = [Uncertainty(PARAMETERS, o, C[k * i : k * i + k, k * i : k * i + k]) for i, o in enumerate(pivots)]
    located = locate_points(cameras, b, sd=sd, uncertainties=known, joint=C)
    at = [derivatives(c, located.point, o) for c, o in zip(cameras, pivots, strict=True)]
    weighted = [d.by_point * w[..., None] for d, w in zip(at, 1 / sd**2, strict=True)]
    noise = np.linalg.inv(sum(np.swapaxes(w, 1, 2) @ d.by_point for w, d in zip(weighted, at, strict=True)))
    by_all = np.concatenate(
        [noise @ np.swapaxes(w, 1, 2) @ d.by_parameter for w, d in zip(weighted, at, strict=True)], -1
    )
    S = noise + by_all @ C @ np.swapaxes(by_all, 1, 2)
    sigma = np.sqrt(np.diagonal(S, axis1=1, axis2=2))
    assert np.isfinite(located.sigma).any()
    assert located.sigma == pytest.approx(sigma, rel=0.02, nan_ok=True)


def test_a_camera_that_does_not_see_a_point_adds_nothing():
    cameras = thesis_rig(3)
    p = np.zeros((4, 3))
    b = np.stack([project(c, p) for c in cameras])
    b[2] = np.nan
    cameras[2] = cameras[2].with_(R=np.diag([-1.0, 1, -1]) @ cameras[2].R)  # it looks the other way
    known = [Uncertainty(NAMES, np.zeros(3), np.diag([STEPS[name] ** 2 for name in NAMES]))] * 3
    three = locate_points(cameras, b, sd=0.1, uncertainties=known)
    two = locate_points(cameras[:2], b[:2], sd=0.1, uncertainties=known[:2])
    assert three.sigma == pytest.approx(two.sigma)


def trial(rng, n, sd, survey, free, *, points=60):
    """Squares of normalised errors (points, 3) of one calibration and what is located with it."""
    tags, hung = thesis_points()
    p = hung + rng.normal(0, survey, hung.shape)
    cameras = thesis_rig(n)
    fits = [
        refine(c, hung, project(c, p) + rng.normal(0, sd, (len(p), 2)), free=free, sd=sd, survey=survey)
        for c in cameras
    ]
    known = [fit.uncertainty for fit in fits]
    surveys = [Survey(tuple(tags), hung, np.full(len(p), survey), sd)] * n
    joint = joint_covariance([fit.camera for fit in fits], known, surveys)
    q = rng.uniform(-1, 1, (points, 3)) * (25, 6, 9)
    b = np.stack([project(c, q) for c in cameras]) + rng.normal(0, sd, (n, points, 2))
    located = locate_points([fit.camera for fit in fits], b, sd=sd, uncertainties=known, joint=joint)
    bare = locate_points([fit.camera for fit in fits], b, sd=sd)
    return ((located.point - q) / located.sigma) ** 2, ((located.point - q) / bare.sigma) ** 2


def test_sigma_is_honest_after_a_calibration():
    # 1/8 in of survey: the calibration's share of the error is then larger than the centroids'
    rng = np.random.default_rng(0)
    free = free_parameters("tsai")
    trials = [trial(rng, 2, 0.1, 1 / 8, free) for _ in range(24)]
    with_calibration = np.mean([own for own, _ in trials])
    assert 0.8 < with_calibration < 1.25
    assert np.mean([bare for _, bare in trials]) > 1.8  # centroid noise alone would flatter


def test_the_joint_covariance_must_fit_the_parameters():
    cameras = thesis_rig(2)
    known = Uncertainty(("f",), np.zeros(3), np.eye(1))
    with pytest.raises(ValueError, match="joint"):
        locate_points(cameras, np.zeros((2, 1, 2)), uncertainties=[known, None], joint=np.eye(2))
