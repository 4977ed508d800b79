"""What is foretold on paper must be what simulated calibrations then show, from below as well as above."""

import numpy as np
import pytest

from vidtrack.calibration.assessment.cramer_rao import mean_length
from vidtrack.calibration.assessment.prediction import Layout, predicted
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")


def _layout(m=2, noise=0.1, tolerance=1 / 32, refine="full", **more):
    p = thesis_points()[1]
    q = np.random.default_rng(0).uniform(-1, 1, (200, 3)) * p.max(0)
    sd = np.full(m, noise)
    return Layout(thesis_rig(m), p, q, tolerance / np.sqrt(3), sd, sd, [FREE] * m, refine)._replace(**more)


@pytest.mark.parametrize(
    ("m", "noise", "tolerance", "attainable"),
    [
        (2, 0.5, 1 / 16, 843),
        (2, 0.25, 1 / 16, 1671),
        (2, 0.1, 1 / 32, 4164),
        (2, 0.05, 1 / 32, 7964),
        (4, 0.1, 1 / 32, 6899),
    ],
)
def test_the_accuracy_that_was_measured_on_the_thesis_rig_is_foretold(m, noise, tolerance, attainable):
    """The notes' table, measured by simulation before this code was written: diagonal 160 in over the mean error."""
    told = predicted(_layout(m, noise, tolerance))
    assert 160 / mean_length(told.covariance).mean() == pytest.approx(attainable, rel=0.02)


@pytest.mark.parametrize("how", ["full", "bundle"])
def test_simulated_calibrations_scatter_as_foretold(how):
    """Survey errors dominate here (.05 px against .13 px): their sharing by both cameras must be right."""
    rng = np.random.default_rng(1)
    layout = _layout(noise=0.05, tolerance=1 / 16, refine=how)
    told = predicted(layout)
    cameras, p, sigma = layout.cameras, layout.p, layout.sigma
    sights = np.array([project(camera, layout.q) for camera in cameras])
    squared, focal = [], []
    for _ in range(30):
        true = p + rng.normal(0, sigma, p.shape)
        b = np.array([project(camera, true) for camera in cameras]) + rng.normal(0, 0.05, (2, 64, 2))
        if how == "bundle":
            found = bundle(cameras, p, b, sigma=sigma, sd=0.05, scale_sd=False, free=layout.free).cameras
        else:
            found = [refine(c, p, s, free=FREE, sd=0.05, survey=sigma).camera for c, s in zip(cameras, b, strict=True)]
        error = locate_points(found, sights + rng.normal(0, 0.05, sights.shape), sd=0.05).point - layout.q
        shape = np.linalg.inv(told.covariance)
        squared.append(np.einsum("na,nab,nb->n", error, shape, error).mean() / 3)
        focal.append((found[0].f - cameras[0].f) / told.parameters[0].standard_errors[FREE.index("f")])
    assert 0.85 < np.mean(squared) < 1.15
    assert 0.6 < np.std(focal) < 1.4


def test_a_bundle_is_foretold_to_be_no_worse_and_nothing_is_below_the_floor():
    full, joint = (predicted(_layout(noise=0.05, tolerance=1 / 16, refine=how)) for how in ("full", "bundle"))
    together, alone = mean_length(joint.covariance), mean_length(full.covariance)
    assert together.mean() < alone.mean()
    assert (together >= mean_length(full.floor)).all()


def test_without_survey_error_bundle_and_full_are_the_same():
    full, joint = (predicted(_layout(tolerance=0.0, refine=how)) for how in ("full", "bundle"))
    np.testing.assert_allclose(joint.joint, full.joint, rtol=1e-9)


def test_places_out_of_the_picture_have_no_accuracy_and_too_few_points_are_said():
    far = _layout()
    told = predicted(far._replace(q=np.array([[0, 0, 0], [500.0, 0, 0]])))
    assert np.isfinite(told.covariance[0]).all()
    assert np.isnan(told.covariance[1]).all()
    np.testing.assert_array_equal(told.n_cameras, [2, 0])
    with pytest.raises(ValueError, match="camera 1 sees 5 calibration points for 11"):
        predicted(far._replace(p=far.p[:5]))
    with pytest.raises(ValueError, match="open"):
        predicted(far._replace(p=far.p * (1, 0, 0)))  # all on one line
