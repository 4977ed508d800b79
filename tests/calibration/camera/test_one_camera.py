"""Which points belong, and the camera by each method."""

import contextlib

import numpy as np
import pytest

from vidtrack.calibration.camera.initial_fit import Nominal
from vidtrack.calibration.camera.one_camera import (
    NoCamera,
    Points,
    Task,
    better_part,
    calibrated,
    inliers,
)
from vidtrack.geometry.camera import project
from vidtrack.geometry.lens_terms import LENS_MODELS
from vidtrack.simulate.rig import thesis_points, thesis_rig

CAMERA = thesis_rig(1)[0]
NOMINAL = Nominal(255.5, 239.5, CAMERA.dx, CAMERA.dy, CAMERA.image_size)


def sighted(seed=0, noise=0.1):
    p = thesis_points()[1]
    return Points(p, project(CAMERA, p) + np.random.default_rng(seed).normal(0, noise, (64, 2)))


def task(refine="full", model="tsai", fixed=None, priors=None):
    return Task(NOMINAL, model, refine, fixed or {}, priors or {})


def test_good_points_all_belong_and_show_their_noise():
    points = sighted()
    found = inliers(points, task(), better_part(points))
    assert found.keep.all()
    assert found.scale == pytest.approx(0.1, rel=0.25)


def test_a_bad_point_does_not_belong():
    points = sighted()
    points.b[10] += [6.0, -8.0]
    found = inliers(points, task(), better_part(points))
    np.testing.assert_array_equal(np.flatnonzero(~found.keep), [10])


def test_of_eleven_points_all_are_kept():
    points = sighted().take(np.arange(0, 64, 6))
    assert inliers(points, task(), better_part(points)).keep.all()


def test_a_plain_lens_s_misfit_is_not_taken_for_bad_points():
    rng = np.random.default_rng(0)
    camera = CAMERA.with_(kappa1=-4e-4, kappa2=1.5e-4, p1=1e-3)
    p = rng.uniform([-60, -40, -40], [60, 40, 40], (150, 3))
    points = Points(p, project(camera, p) + rng.normal(0, 0.1, (150, 2)))
    assert inliers(points, task(), better_part(points)).keep.all()


def test_the_methods_leave_less_and_less():
    left = [calibrated(sighted(), task(refine)).fit.rms_px for refine in ("linear", "centre", "full")]
    assert left[0] > left[1] > left[2]
    assert left[2] == pytest.approx(0.1 * np.sqrt(2), rel=0.15)


def test_the_closed_form_keeps_the_centre_given_and_frees_it_in_no_standard_error():
    answer = calibrated(sighted(), task("linear"))
    assert (answer.camera.Cx, answer.camera.Cy) == (255.5, 239.5)
    assert "Cx" not in answer.uncertainty.names
    assert "Cx" in calibrated(sighted(), task("centre")).uncertainty.names


def test_a_prior_is_heard():
    tight = calibrated(sighted(), task(priors={"Cx": (250.0, 1e-3)}))
    assert tight.camera.Cx == pytest.approx(250, abs=0.01)


def test_auto_says_where_it_climbed():
    answer = calibrated(sighted(), task(model="auto"))
    assert answer.model == "tsai"
    assert len(answer.ladder.reasons) == len(LENS_MODELS)


def test_nonsense_has_no_camera_or_one_that_explains_nothing():
    rng = np.random.default_rng(0)
    points = Points(rng.normal(size=(20, 3)), rng.normal(size=(20, 2)))
    with contextlib.suppress(NoCamera):
        assert calibrated(points, task()).fit.sigma_px > 0.3  # of a spread of 1


def test_a_mirror_has_no_camera():
    points = sighted()
    with pytest.raises(NoCamera, match="makes no camera"):
        calibrated(points._replace(p=points.p * [1, 1, -1]), task("linear"))


def test_few_points_cannosame_every_time_and_keeps_all_of_few():
    points = sighted()
    assert points.thinned(64) is points
    np.testing.assert_array_equal(points.thinned(20).p, points.thinned(20).p)
    assert points.thinned(20).n == 20
