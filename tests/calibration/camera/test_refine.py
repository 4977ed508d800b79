"""The refinement: Willson's optimum, honest standard errors, priors and what is held."""

from pathlib import Path

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import _step, best_of, free_parameters, inverse_root, refine, whiteners
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import stepped
from vidtrack.simulate.rig import thesis_points, thesis_rig

REAL = Path(__file__).parents[3] / "../shared/real/points"
FREE = free_parameters("tsai")


def rig(seed=0, noise=0.1, **changes):
    """The thesis's first camera, its 64 points, and where it sees them with noise (px)."""
    camera = thesis_rig(1)[0].with_(**changes)
    p = thesis_points()[1]
    return camera, p, project(camera, p) + np.random.default_rng(seed).normal(0, noise, (64, 2))


def off(camera, p):
    """A start that is some way off."""
    return stepped(camera, p.mean(0), {"omega_x": 0.02, "t_z": 5.0, "f": 0.4, "Cx": 8.0, "Cy": -9.0, "kappa1": -4e-4})


def test_plain_tsai_frees_eleven_parameters():
    assert FREE == ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z", "f", "Sx", "Cx", "Cy", "kappa1")
    assert len(free_parameters("affine")) == 15
    assert "Sx" not in free_parameters("brown", ("Sx",))


def test_an_unknown_lens_is_named_with_those_there_are():
    with pytest.raises(
        ValueError, match=r"pinhole.*tsai, equidistant, tsai2, tsai3, fisheye, brown, affine, prism, quadratic"
    ):
        free_parameters("pinhole")


def test_exact_points_bring_back_the_exact_camera():
    camera, p, _ = rig()
    fit = refine(off(camera, p), p, project(camera, p), free=FREE)
    assert fit.converged
    assert fit.rms_px < 1e-9
    assert fit.camera.kappa1 == pytest.approx(camera.kappa1, rel=1e-6)


@pytest.mark.parametrize("model", ["tsai2", "brown", "affine"])
def test_the_richer_terms_are_found_too(model):
    camera = thesis_rig(1)[0].with_(kappa1=1e-3, kappa2=2e-5, p1=1e-4, p2=-1e-4, skew=2e-3)
    terms = {"tsai2": ("p1", "p2", "skew"), "brown": ("skew",), "affine": ()}[model]
    camera = camera.with_(**dict.fromkeys(terms, 0.0))
    p = np.random.default_rng(0).uniform([-60, -40, -40], [60, 40, 40], (200, 3))
    b = project(camera, p)
    fit = refine(camera.with_(kappa2=0.0, p1=0.0, p2=0.0, skew=0.0), p, b, free=free_parameters(model))
    assert fit.rms_px < 1e-8
    for name in ("kappa2", "p1", "p2", "skew"):
        assert getattr(fit.camera, name) == pytest.approx(getattr(camera, name), rel=1e-4, abs=1e-9), name


def test_the_error_that_is_left_is_the_noise_with_the_parameters_counted():
    """sigma_px over 40 draws of 0.1 px: within 4 standard errors (0.1 / sqrt(2 * 117 * 40)) on both sides."""
    found = [refine(*rig(seed)[:3], free=FREE).sigma_px ** 2 for seed in range(40)]
    assert np.sqrt(np.mean(found)) == pytest.approx(0.1, abs=4 * 0.1 / np.sqrt(2 * 117 * 40))


def test_standard_errors_are_honest():
    """Normalised errors of the image of points: variance 0.8 to 1.25; f and Tz alone trade off, pixels do not."""
    camera, p, _ = rig()
    z = []
    for seed in range(60):
        fit = refine(camera, p, rig(seed)[2], free=FREE)
        truth = np.array([getattr(camera, name) for name in FREE[6:]])
        found = np.array([getattr(fit.camera, name) for name in FREE[6:]])
        z.append((found - truth) / fit.uncertainty.standard_errors[6:])
    assert (np.var(z, axis=0) > 0.5).all()
    assert (np.var(z, axis=0) < 1.8).all()
    assert 0.8 < np.var(z) < 1.25


def test_correlations_are_one_with_themselves_and_f_goes_with_the_distance():
    camera, p, b = rig()
    u = refine(camera, p, b, free=FREE).uncertainty
    np.testing.assert_allclose(np.diag(u.correlations), 1)
    assert abs(u.correlations[FREE.index("f"), FREE.index("t_z")]) > 0.9


def test_noise_said_too_small_does_not_flatter_the_standard_errors():
    camera, p, b = rig()
    plain, boast = (refine(camera, p, b, free=FREE, sd=sd) for sd in (None, 0.001))
    np.testing.assert_allclose(boast.uncertainty.covariance, plain.uncertainty.covariance, rtol=1e-4)
    assert boast.misfit == pytest.approx(plain.sigma_px / 0.001, rel=1e-6)


def test_what_is_not_freed_stays():
    camera, p, b = rig()
    fit = refine(camera.with_(Sx=1.0), p, b, free=free_parameters("tsai", ("Sx", "kappa1")))
    assert fit.camera.Sx == 1.0
    assert fit.camera.kappa1 == camera.kappa1
    assert fit.uncertainty.covariance.shape == (9, 9)


def test_a_tight_prior_holds_and_a_loose_one_lets_go():
    camera, p, b = rig()
    tight, loose, none = (
        refine(camera, p, b, free=FREE, priors=priors) for priors in ({"Cx": (240.0, 1e-4)}, {"Cx": (240.0, 1e4)}, {})
    )
    assert tight.camera.Cx == pytest.approx(240, abs=1e-3)
    assert loose.camera.Cx == pytest.approx(none.camera.Cx, abs=1e-3)


def test_a_prior_weighs_as_its_standard_deviation_says():
    """With the points' own estimate 264 +- s and a prior 10 off of the same s, the answer lies half way."""
    camera, p, b = rig()
    alone = refine(camera, p, b, free=FREE)
    s = alone.uncertainty.standard_errors[FREE.index("Cx")]
    both = refine(camera, p, b, free=FREE, priors={"Cx": (alone.camera.Cx + 2 * s, s)})
    assert both.camera.Cx - alone.camera.Cx == pytest.approx(s, rel=0.1)
    assert both.uncertainty.standard_errors[FREE.index("Cx")] == pytest.approx(s / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize("priors", [{"kappa2": (0, 1)}, {"omega_x": (0, 1)}])
def test_a_prior_on_what_is_not_freed_is_refused(priors):
    camera, p, b = rig()
    with pytest.raises(ValueError, match=next(iter(priors))):
        refine(camera, p, b, free=FREE, priors=priors)


def test_lost_points_are_the_caller_s_to_leave_out():
    camera, p, b = rig()
    b[3] = np.nan
    with pytest.raises(ValueError, match="finite"):
        refine(camera, p, b, free=FREE)


def test_the_survey_s_tolerance_is_projected_into_the_picture():
    """0.5 in at 160 in with f / dy = 796 px is 2.5 px across, and 0.1 px of noise vanishes beside it."""
    camera, p, _ = rig()
    W = whiteners(camera, p, 0.1, 0.5)
    sd = np.sqrt(np.linalg.inv(np.swapaxes(W, 1, 2) @ W)[:, 1, 1])
    assert sd.mean() == pytest.approx(0.5 * camera.f / camera.dy / 160, rel=0.05)


def test_a_badly_surveyed_point_weighs_little():
    camera, p, b = rig()
    wrong = p.copy()
    wrong[10] += [0.0, 0.0, 5.0]
    survey = np.full(64, 0.01)
    survey[10] = 5.0
    told, untold = (refine(camera, wrong, b, free=FREE, sd=0.1, survey=s).camera for s in (survey, 0.01))
    errors = [np.abs(project(c, p) - project(camera, p)).max() for c in (told, untold)]
    assert errors[0] < 0.2 < errors[1]


def test_inverse_root_whitens():
    C = np.array([[2.0, 0.7], [0.7, 1.0]])
    W = inverse_root(C)
    np.testing.assert_allclose(W @ C @ W.T, np.eye(2), atol=1e-12)


def test_points_that_settle_nothing_say_so():
    camera, p, b = rig()
    fit = refine(camera, p[:4], b[:4], free=FREE)
    assert not fit.converged or not np.isfinite(fit.uncertainty.covariance).all()


def test_a_start_that_looks_the_other_way_says_so():
    camera, p, b = rig()
    behind = camera.with_(T=camera.T - [0, 0, 400.0])
    fit = refine(behind, p, b, free=FREE)
    assert not fit.converged
    assert "start" in fit.message


def test_the_best_of_several_is_the_converged_one_of_least_cost():
    camera, p, b = rig()
    good, rough = refine(camera, p, b, free=FREE), refine(off(camera, p), p, b, free=FREE, max_iterations=1)
    assert best_of([rough, good]) is good


@pytest.mark.skipif(not REAL.exists(), reason="needs ../shared/real")
def test_willson_s_points_reach_their_optimum():
    """Outside witness: sum of squares 2.399750 px^2, f 69.87497 +- .229, C (262.3032 +- .43, 212.3560 +- .72)."""
    t = np.genfromtxt(REAL / "willson_ncc/cam1.csv", delimiter=",", skip_header=1)
    p, b = t[:, 1:4], t[:, 4:6]
    start = thesis_start(p, b)
    fit = refine(start, p, b, free=FREE)
    assert (fit.residuals**2).sum() <= 2.39976
    assert fit.camera.f == pytest.approx(69.87497, abs=1e-4)
    assert fit.camera.kappa1 == pytest.approx(-6.05920e-4, abs=1e-8)
    assert fit.camera.Cx == pytest.approx(262.3032, abs=1e-3)
    sd = dict(zip(FREE, fit.uncertainty.standard_errors, strict=True))
    assert sd["f"] == pytest.approx(0.229, abs=0.001)
    assert sd["Cx"] == pytest.approx(0.43, abs=0.01)
    assert sd["Cy"] == pytest.approx(0.72, abs=0.01)


def thesis_start(p, b):
    from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form

    return camera_from_closed_form(closed_form(p, b, Cx=258, Cy=204, dx=0.023, dy=0.023), (576, 384))


def test_a_step_leaves_alone_what_no_point_settles():
    assert _step(np.ones((2, 2)), np.ones(2), 0.0) == pytest.approx([0.5, 0.5])
