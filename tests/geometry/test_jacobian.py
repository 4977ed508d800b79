"""Analytic derivatives against finite differences, for any camera and any parameter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.geometry.test_camera import cameras, straight_on
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, derivatives, position_covariance, stepped
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import thesis_rig

some = settings(max_examples=30, deadline=None)

STEP = {"f": 1e-5, "Sx": 1e-6, "Cx": 1e-3, "Cy": 1e-3, "kappa1": 1e-8, "kappa2": 1e-9, "kappa3": 1e-9}
STEP |= dict.fromkeys(("p1", "p2", "s1", "s2", "q1", "q2"), 1e-8)


def points_before(camera, seed=0):
    """Points in front of a camera, well inside its picture."""
    rng = np.random.default_rng(seed)
    c = np.stack([rng.uniform(-0.06, 0.06, 8), rng.uniform(-0.06, 0.06, 8), np.ones(8)], -1)
    return camera.position + (c * rng.uniform(50, 300, (8, 1))) @ camera.R


@some
@given(cameras(), st.integers(0, 5))
def test_derivatives_by_parameters_are_those_of_finite_differences(camera, seed):
    p = points_before(camera, seed)
    pivot = p.mean(0)
    J = derivatives(camera, p, pivot).by_parameter
    for k, name in enumerate(PARAMETERS):
        h = STEP.get(name, 1e-6)
        up, down = (project(stepped(camera, pivot, {name: s}), p) for s in (h, -h))
        numeric = (up - down) / (2 * h)
        size = np.nanmax(np.abs(numeric), initial=1.0)
        np.testing.assert_allclose(J[..., k], numeric, atol=3e-4 * size, err_msg=name)


@some
@given(cameras(), st.integers(0, 5))
def test_derivatives_by_points_are_those_of_finite_differences(camera, seed):
    p = points_before(camera, seed)
    J = derivatives(camera, p, p.mean(0)).by_point
    h = 1e-4
    numeric = np.stack([(project(camera, p + h * e) - project(camera, p - h * e)) / (2 * h) for e in np.eye(3)], -1)
    np.testing.assert_allclose(J, numeric, atol=1e-6 * np.nanmax(np.abs(numeric), initial=1.0))


@some
@given(cameras())
def test_the_projection_that_comes_along_is_project_s(camera):
    p = points_before(camera)
    np.testing.assert_allclose(derivatives(camera, p, p[0]).projected, project(camera, p), atol=1e-9)


def test_turning_about_the_pivot_leaves_the_pivot_where_it_is():
    camera = straight_on(T=np.array([0, 0, 100.0]))
    pivot = np.array([3.0, -4.0, 5.0])
    turned = stepped(camera, pivot, {"omega_x": 0.1, "omega_y": -0.2, "omega_z": 0.3})
    np.testing.assert_allclose(project(turned, pivot), project(camera, pivot), atol=1e-10)


def test_a_step_of_the_pivot_is_in_camera_axes():
    camera = straight_on(R=rotation_from_vector([0.4, 0.5, 0.6]), T=np.array([0, 0, 100.0]))
    pivot = np.array([1.0, 2.0, 3.0])
    moved = stepped(camera, pivot, {"t_z": 2.0})
    np.testing.assert_allclose(moved.R @ pivot + moved.T, camera.R @ pivot + camera.T + [0, 0, 2])


def test_points_that_do_not_project_have_no_derivatives():
    d = derivatives(straight_on(), [[0, 0, -1.0], [0, 0, 5.0]], np.zeros(3))
    assert np.isnan(d.by_parameter[0]).all()
    assert np.isnan(d.by_point[0]).all()
    assert np.isfinite(d.by_parameter[1]).all()


def test_a_step_that_makes_no_camera_is_refused():
    with pytest.raises(ValueError, match="positive"):
        stepped(straight_on(), np.zeros(3), {"f": -20.0})


def test_the_centres_covariance_is_that_of_cameras_drawn_from_the_parameters_covariance():
    """Four thousand cameras with small random errors: their covariance is good to a tenth."""
    rng = np.random.default_rng(3)
    camera, pivot = thesis_rig()[0], np.array([3.0, -2.0, 5.0])
    names = ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z", "f")
    A = rng.normal(0, 1, (7, 7)) * np.array([1e-4, 1e-4, 1e-4, 0.01, 0.01, 0.01, 0.01])[:, None]
    steps = rng.multivariate_normal(np.zeros(7), A @ A.T, 4000)
    places = np.array([stepped(camera, pivot, dict(zip(names, step, strict=True))).position for step in steps])
    predicted = position_covariance(camera, names, pivot, A @ A.T)
    scale = np.sqrt(np.outer(np.diagonal(predicted), np.diagonal(predicted)))
    assert np.cov(places.T) / scale == pytest.approx(predicted / scale, abs=0.1)
