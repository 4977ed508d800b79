"""A survey whose axes are stretched or not at right angles is seen so by all cameras together."""

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.surveys.survey_stretch import stretches
from vidtrack.geometry.camera import project
from vidtrack.geometry.interface import Interface
from vidtrack.simulate.rig import thesis_points, thesis_rig

P = thesis_points()[1]
FREE = free_parameters("tsai")


def found(deform, *, m=2, noise=0.1, known=True, model="tsai", sensor=1.0, survey=0.0, seed=0):
    """What cameras calibrated on a deformed survey say of it; sensor: width of a pixel over its height."""
    rng = np.random.default_rng(seed)
    rig = [camera.with_(Sx=sensor) for camera in thesis_rig(m)]
    stated = (P - P.mean(0)) @ np.asarray(deform).T + P.mean(0) + rng.normal(0, survey, P.shape)
    b = np.stack([project(camera, P) + rng.normal(0, noise, (len(P), 2)) for camera in rig])
    names = free_parameters(model)
    fitted = [refine(camera, stated, own, free=names).camera for camera, own in zip(rig, b, strict=True)]
    sigma = np.full(len(P), survey)
    return stretches(fitted, stated, b, [names] * m, [{}] * m, sigma=sigma, sd=noise if known else np.nan)


def along(axis, share):
    deform = np.eye(3)
    deform[axis, axis] += share
    return deform


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("share", [0.02, -0.02])
def test_an_axis_that_is_stretched_is_named_with_its_share(axis, share, known):
    each = found(along(axis, share), known=known)
    own = next(one for one in each if one.kind == "xyz"[axis])
    assert own.gain > each[0].gain - 9  # of two cameras, the other axis' shrinking may explain as much
    assert own.share == pytest.approx(share, abs=4 * own.sd)
    assert own.sd < abs(share) / 8


def test_axes_that_are_not_at_right_angles_are_named_with_their_angle():
    shear = np.eye(3)
    shear[0, 2] = shear[2, 0] = 0.01
    best = found(shear, m=4)[0]
    assert best.kind == "xz"
    assert best.share == pytest.approx(0.02, abs=5 * best.sd)


def test_noise_alone_stays_within_its_standard_deviation():
    worst = [max(abs(each.share) / each.sd for each in found(np.eye(3), seed=seed)) for seed in range(25)]
    assert max(worst) < 4.0
    assert np.mean(worst) > 0.5  # and the standard deviation is not so large that it hides all


def test_a_rough_survey_seen_with_fine_centroids_is_no_stretch():
    """Cameras fitted to it one by one are bent by it: their common answer lies beyond the reach of a tangent."""
    worst = [
        max(abs(each.share) / each.sd for each in found(np.eye(3), m=3, noise=0.005, survey=0.08, seed=seed))
        for seed in range(12)
    ]
    assert max(worst) < 4.0


def test_a_survey_larger_along_all_axes_cannot_be_seen():
    assert max(abs(each.share) / each.sd for each in found(1.05 * np.eye(3))) < 4.0


def test_a_lens_model_with_skew_does_not_hide_it():
    each = found(along(0, 0.02), model="affine")
    own = next(one for one in each if one.kind == "x")
    assert own.share > 5 * own.sd
    assert own.gain > each[0].gain - 9


def test_pixels_that_a_frame_grabber_widens_by_half_a_percent_are_no_stretch():
    assert all(abs(each.share) < 4 * each.sd for each in found(np.eye(3), sensor=1.005))


def test_rough_surveys_widen_the_standard_deviation_with_or_without_a_stated_tolerance():
    fine = {each.kind: each.sd for each in found(np.eye(3))}
    rough = {each.kind: each.sd for each in found(np.eye(3), survey=0.2)}
    assert all(rough[kind] > 1.5 * fine[kind] for kind in "xy")


def test_too_few_points_and_interfaces_say_nothing():
    camera = thesis_rig(1)[0]
    b = project(camera, P)[None]
    few = np.where(np.arange(len(P))[None, :, None] < 8, b, np.nan)
    how = {"sigma": np.zeros(len(P)), "sd": 0.1}
    assert stretches([camera], P, few, [FREE], [{}], **how) == []
    window = Interface("window", camera.position * 0.9, np.array([0.0, 1, 0]), (1.0, 1.333), (), (0, 0, 0, 0))
    assert stretches([camera.with_(through=(window,))], P, b, [FREE], [{}], **how) == []
    assert stretches([camera], P, b, [FREE], [{}], sigma=np.zeros(len(P)), sd=np.nan) == []  # exact sights: no noise
