import numpy as np
import pytest

from vidtrack.calibration.assessment.refit import CameraRefit
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")
P = thesis_points()[1]


def _fit(seed=0, **more):
    rng = np.random.default_rng(seed)
    camera = thesis_rig()[0]
    b = project(camera, P + rng.normal(0, 0.02, P.shape)) + rng.normal(0, 0.1, (64, 2))
    return refine(camera, P, b, free=FREE, sd=0.1, survey=0.02, **more).camera, b


@pytest.mark.parametrize("prior", [{}, {"Cx": (250.0, 3.0)}])
def test_the_camera_without_some_points_is_the_careful_fit_without_them(prior, monkeypatch):
    monkeypatch.setattr(CameraRefit, "_from_scratch", None)  # a few quick steps must do
    camera, b = _fit(priors=prior)
    warm = CameraRefit(camera, P, b, FREE, np.full(64, 0.02), 0.1, prior)
    out = np.arange(64) % 7 == 2
    careful = refine(camera, P[~out], b[~out], free=FREE, sd=0.1, survey=0.02, priors=prior).camera
    found = warm.without(out)
    assert np.abs(project(found, P) - project(careful, P)).max() < 2e-3  # 2 % of the noise
    assert abs(found.Cx - careful.Cx) < 0.1  # 3 px is its standard error, with or without this prior


def test_far_from_the_answer_it_still_finds_it():
    camera, b = _fit()
    far = camera.with_(f=camera.f * 1.1, Cx=camera.Cx + 20)
    warm = CameraRefit(far, P, b, FREE, np.full(64, 0.02), 0.1, {})
    assert np.abs(project(warm.without(np.zeros(64, bool)), P) - project(camera, P)).max() < 0.02


def test_lost_points_are_left_out_and_too_few_refused():
    camera, b = _fit()
    b[:3] = np.nan
    warm = CameraRefit(camera, P, b, FREE, np.zeros(64), None, {})
    assert np.isfinite(warm.without(np.arange(64) == 10).f)
    with pytest.raises(ValueError, match="5 points for 11"):
        warm.without(np.arange(64) >= 8)


def test_a_step_that_puts_a_point_behind_the_camera_reaches_no_solver(monkeypatch, capfd):
    """LAPACK would print of illegal values, and raise."""
    camera, b = _fit()
    warm = CameraRefit(camera, P, b, FREE, np.full(64, 0.02), 0.1, {})
    warm.r = np.full_like(warm.r, np.nan)
    monkeypatch.setattr(CameraRefit, "_step", None)
    found = warm.without(np.arange(64) == 3)
    assert np.abs(project(found, P) - project(camera, P)).max() < 0.5
    assert capfd.readouterr() == ("", "")
