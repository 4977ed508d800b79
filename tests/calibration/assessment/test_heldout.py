"""Held-out errors are those of points that the calibration never saw."""

import numpy as np
import pytest

from vidtrack.calibration.assessment.cramer_rao import located_covariance, mean_length
from vidtrack.calibration.assessment.heldout import held_out, refit_alone, refit_closed_form, refit_together
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")
SIGMA = 1 / 32 / np.sqrt(3)


@pytest.fixture(scope="module")
def rig():
    rng = np.random.default_rng(7)
    cameras, p = thesis_rig(), thesis_points()[1]
    b = np.array([project(c, p + rng.uniform(-1, 1, p.shape) / 32) for c in cameras]) + rng.normal(0, 0.1, (2, 64, 2))
    fits = [refine(camera, p, sights, free=FREE).camera for camera, sights in zip(cameras, b, strict=True)]
    return fits, p, b


def test_the_cameras_never_see_the_points_that_they_locate(rig):
    fits, p, b = rig
    seen = []

    def spy(keep):
        seen.append(keep.copy())
        return fits

    out = held_out(p, b, spy)
    assert out.method == "leave-one-out"
    assert len(seen) == 64
    assert all(keep.sum() == 63 for keep in seen)
    assert (np.array(seen).sum(0) == 63).all()
    np.testing.assert_allclose(out.located, locate_points(fits, b, sd=1.0).point, atol=1e-9)


def test_many_points_are_divided_into_ten_folds_of_equal_size(rig):
    fits, p, b = rig
    many, sights = np.tile(p, (3, 1)), np.tile(b, (1, 3, 1))
    out = held_out(many, sights, lambda keep: fits)
    assert out.method == "10-fold"
    assert set(np.bincount(out.fold)) == {19, 20}
    assert (held_out(many, sights, lambda keep: fits).fold == out.fold).all()


def test_a_warm_refit_without_a_point_is_the_cold_fit_without_it(rig):
    fits, p, b = rig
    keep = np.arange(64) != 11
    warm = refit_alone(fits, p, b, free=[FREE] * 2)(keep)
    cold = [refine(camera, p[keep], b[i, keep], free=FREE).camera for i, camera in enumerate(thesis_rig())]
    for ours, theirs in zip(warm, cold, strict=True):
        assert np.abs(project(ours, p) - project(theirs, p)).max() < 1e-3  # 1 % of the noise


def test_held_out_errors_exceed_training_errors_and_the_floor_by_what_calibration_costs(rig):
    """22 parameters from 64 points: about 4 to 20 % above the floor of noise and survey; less would be too good."""
    fits, p, b = rig
    training = np.linalg.norm(locate_points(fits, b, sd=1.0).point - p, axis=-1).mean()
    floor = mean_length(located_covariance(fits, p, 0.1) + SIGMA**2 * np.eye(3)).mean()
    for refit in (
        refit_alone(fits, p, b, free=[FREE] * 2),
        refit_together(fits, p, b, free=[FREE] * 2, sigma=SIGMA, sd=0.1),
        refit_closed_form(fits, p, b),
    ):
        held = np.linalg.norm(held_out(p, b, refit, folds=16).error, axis=-1).mean()
        assert held > training
        assert 0.85 < held / floor < 1.35  # 64 points: 6 % of scatter


@pytest.mark.slow
def test_held_out_errors_tell_a_lens_that_is_too_rich(rig):
    """With few points and noise, freeing everything must show in held-out errors though it lowers training ones."""
    _, p, b = rig
    few = np.arange(64) % 4 == 0
    p, b = p[few], b[:, few]
    training, held = [], []
    for model in ("tsai", "brown"):
        free = free_parameters(model)
        cameras = [refine(c, p, s, free=free).camera for c, s in zip(thesis_rig(), b, strict=True)]
        out = held_out(p, b, refit_alone(cameras, p, b, free=[free] * 2), folds=3)
        held.append(np.sqrt(np.nanmean(out.sight_error**2)))
        training.append(np.sqrt(np.mean([(project(c, p) - s) ** 2 for c, s in zip(cameras, b, strict=True)])))
    assert training[1] < training[0]
    assert held[1] > held[0]


def test_a_fold_whose_rest_is_too_few_has_no_answer():
    cameras, p = thesis_rig(), thesis_points()[1][::11]
    b = np.array([project(camera, p) for camera in cameras])
    assert len(p) == 6
    out = held_out(p, b, refit_alone(cameras, p, b, free=[FREE] * 2))
    assert np.isnan(out.located).all()


def test_one_camera_still_has_held_out_errors_in_the_picture(rig):
    fits, p, b = rig
    out = held_out(p, b[:1], refit_alone(fits[:1], p, b[:1], free=[FREE]), folds=8)
    assert np.isnan(out.located).all()
    assert 0.1 < np.sqrt(np.mean(out.sight_error**2)) < 0.2  # .1 px and 1/32 in make .125 px
    assert bundle(fits, p, b, sigma=SIGMA, free=[FREE] * 2).converged
