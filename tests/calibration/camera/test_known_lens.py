"""Few points place a camera whose lens is known, as well as any method can, and what they leave open is said."""

import numpy as np
import pytest

from tests.geometry.test_brown import WIDE
from vidtrack.calibration.adjustment.measurements import steps_between
from vidtrack.calibration.camera.known_lens import KnownLens, placed, places, rivals
from vidtrack.calibration.camera.refine import POSE, covariance_of
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.lens_conversion import camera_from_brown
from vidtrack.simulate.rig import thesis_points, thesis_rig

CAMERA = thesis_rig(1)[0]
ALL = thesis_points()[1]
NOISE = 0.1


def some(seed, n, noise=NOISE, camera=CAMERA):
    """n of the thesis's points, and where the camera sees them with noise (px)."""
    rng = np.random.default_rng(seed)
    p = ALL[rng.permutation(len(ALL))[:n]]
    return p, project(camera, p) + rng.normal(0, noise, (n, 2))


def place(lens, p, b, noise=NOISE, **how):
    return placed(lens, p, b, np.full(b.shape, noise), None, **how)


def in_bounds(seed, n):
    """The squared error of the pose over the Cramer-Rao bound, and over its own covariance; 1 on average."""
    p, b = some(seed, n)
    fit = place(KnownLens(CAMERA, "tsai"), p, b).fit
    step = steps_between(CAMERA, fit.camera, p.mean(0))
    error = np.array([step[name] for name in POSE])
    J = derivatives(CAMERA, p, p.mean(0)).by_parameter[..., :6].reshape(-1, 6) / NOISE
    own = error @ np.linalg.solve(fit.uncertainty.covariance, error) / 6
    return error @ np.linalg.solve(covariance_of(J), error) / 6, own


def test_five_points_are_within_the_cramer_rao_bound_and_sigma_is_honest():
    """Over 40 seeded trials the rms error is at most 1.2 times the bound, and 0.8 to 1.25 of its own sigma."""
    bound, own = np.sqrt(np.mean([in_bounds(seed, 5) for seed in range(40)], axis=0))
    assert bound < 1.2
    assert 0.8 < own < 1.25


def test_four_points_place_the_camera():
    p, b = some(3, 4)
    found = place(KnownLens(CAMERA, "tsai"), p, b)
    assert np.linalg.norm(found.fit.camera.position - CAMERA.position) < 1.0
    assert not found.rivals


def test_a_far_world_origin_changes_nothing():
    p, b = some(1, 5)
    origin = np.array([5e5, -3e6, 200.0])
    near, far = place(KnownLens(CAMERA, "tsai"), p, b), place(KnownLens(CAMERA, "tsai"), p + origin, b)
    np.testing.assert_allclose(far.fit.camera.position - near.fit.camera.position, origin, atol=1e-3)


def test_a_wide_lens_is_placed_too():
    camera = camera_from_brown(WIDE, T=[0, 0, 60.0]).camera
    p = np.random.default_rng(0).uniform(-40, 40, (5, 3))
    b = project(camera, p)
    found = place(KnownLens(camera_from_brown(WIDE).camera, "fisheye"), p, b)
    np.testing.assert_allclose(found.fit.camera.position, camera.position, atol=1e-6)


def test_three_points_have_several_places():
    p, b = some(0, 3, noise=0.0)
    assert len(places(CAMERA, p, b, None, None)) > 1


def test_a_small_plane_far_away_has_a_rival_and_a_large_one_has_none():
    """A square of 4 points seen from 200 times its size tips to either side within the noise."""
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    camera = CAMERA.with_(R=np.eye(3), T=[0.0, 0.0, 200.0])
    turned = square @ np.array([[0.9, 0.1, 0.42], [0.0, 0.97, -0.23], [-0.43, 0.2, 0.88]]).T
    rng = np.random.default_rng(0)
    small = place(KnownLens(camera, "tsai"), turned, project(camera, turned) + rng.normal(0, NOISE, (4, 2)))
    assert len(small.rivals) == 1
    large = place(KnownLens(camera, "tsai"), 40 * turned, project(camera, 40 * turned) + rng.normal(0, NOISE, (4, 2)))
    assert not large.rivals


def test_a_lens_known_with_a_covariance_is_refined_and_sigma_has_it():
    """Over 40 trials in which the lens itself errs: 0.8 to 1.25 of the stated sigma, all parameters together."""
    names = ("f", "Cx", "Cy", "kappa1")
    C = np.diag([0.05, 1.0, 1.0, 1e-5]) ** 2
    C[0, 3] = C[3, 0] = 0.6 * 0.05 * 1e-5
    z = []
    for seed in range(40):
        p, b = some(seed, 6)
        error = np.random.default_rng(seed + 100).multivariate_normal(np.zeros(4), C)
        given = CAMERA.with_(**{n: getattr(CAMERA, n) + e for n, e in zip(names, error, strict=True)})
        u = (fit := place(KnownLens(given, "tsai", names, C), p, b).fit).uncertainty
        step = steps_between(CAMERA, fit.camera, u.pivot)
        e = np.array([step[name] for name in u.names])
        z.append(e @ np.linalg.solve(u.covariance, e) / len(e))
    assert 0.8 < np.sqrt(np.mean(z)) < 1.25


def test_a_gross_error_among_six_is_left_out_and_among_five_suspected():
    for n in (6, 9, 20):
        p, b = some(2, n)
        b[3] += [15.0, -6.0]
        assert (~place(KnownLens(CAMERA, "tsai"), p, b).keep).nonzero()[0].tolist() == [3]
    p, b = some(2, 5)
    b[3] += [40.0, -25.0]
    found = place(KnownLens(CAMERA, "tsai"), p, b)
    assert found.keep.all()
    assert found.suspect >= 0


def test_good_points_are_not_suspected():
    found = [place(KnownLens(CAMERA, "tsai"), *some(seed, n)) for seed in range(15) for n in (5, 7)]
    assert all(each.keep.all() and each.suspect < 0 for each in found)


def test_every_point_is_kept_where_the_user_says_so():
    p, b = some(2, 7)
    b[3] += 15.0
    assert place(KnownLens(CAMERA, "tsai"), p, b, reject=False).keep.all()


def test_points_behind_a_fold_have_no_place():
    folding = CAMERA.with_(kappa1=-0.5)
    p, b = some(0, 5)
    assert placed(KnownLens(folding, "tsai"), p, b, None, None) is None


def test_the_best_place_is_no_rival_of_itself():
    p, b = some(0, 6)
    assert rivals(places(CAMERA, p, b, None, None)[:1]) == []


@pytest.mark.parametrize("survey", [0.02, 0.2])
def test_the_survey_s_tolerance_widens_the_place(survey):
    p, b = some(0, 6)
    exact = place(KnownLens(CAMERA, "tsai"), p, b).fit
    rough = placed(KnownLens(CAMERA, "tsai"), p, b, np.full(b.shape, NOISE), np.full(6, survey)).fit
    assert (rough.uncertainty.standard_errors > exact.uncertainty.standard_errors).all()
