"""What calibration errors add to a located point."""

import numpy as np
import pytest

from vidtrack.calibration.refine import Uncertainty, free_parameters, refine
from vidtrack.camera import project
from vidtrack.jacobian import stepped
from vidtrack.location.shared_survey import Survey, joint_covariance
from vidtrack.location.triangulate import locate_points
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
