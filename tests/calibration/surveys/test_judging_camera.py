"""One camera as a judge: the errors that it gives are those of points that had no part in the fit."""

import numpy as np
import pytest

from tests.calibration.rigs import ring, seen, wires
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.surveys.judging_camera import JudgingCamera, View
from vidtrack.geometry.camera import project


@pytest.fixture(scope="module")
def camera():
    rng = np.random.default_rng(1)
    _, p = wires()
    (camera,) = ring(1, rng)
    return JudgingCamera.of(p, View(seen([camera], p, rng, 0.3)[0], camera.image_size))


def test_the_error_of_a_point_is_that_of_a_fit_without_it(camera):
    nothing = np.zeros(25, bool)
    fit = camera.fitted(nothing, nothing)
    assert fit.kept.all()
    free = free_parameters(camera.model)
    for j in (0, 7, 24):
        keep = np.arange(25) != j
        without = refine(fit.camera, camera.p[keep], camera.view.b[keep], free=free).camera
        np.testing.assert_allclose(fit.error[j], camera.view.b[j] - project(without, camera.p[j]), rtol=0.05, atol=0.02)


def test_points_left_out_are_predicted_with_a_larger_variance(camera):
    nothing = np.zeros(25, bool)
    out = nothing.copy()
    out[20:] = True
    fit = camera.fitted(out, nothing)
    assert not fit.kept[out].any()
    trace = np.trace(fit.variance, axis1=1, axis2=2) / 2
    assert (trace[out] > fit.scale**2).all()


def test_a_camera_of_few_points_has_no_vote():
    _, p = wires()
    (own,) = ring(1, np.random.default_rng(1))
    b = project(own, p)
    b[11:] = np.nan
    assert JudgingCamera.of(p, View(b, own.image_size)) is None
