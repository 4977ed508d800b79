"""Where the uncertainty of a fix comes from, against what was put in."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.cameras.run_pictures import Uncertain
from vidtrack.location.sight_lines.budget import _root, calibration_field, error_budget
from vidtrack.location.sight_lines.shared_survey import Survey, joint_covariance, survey_covariance
from vidtrack.simulate.rig import thesis_points, thesis_rig

CAMERAS = list(thesis_rig())
TAGS, POINTS = thesis_points()
SIGHT, SURVEY = 0.02, 0.03125


def fitted(camera, sigma=SURVEY):
    """What a least-squares fit to the survey leaves open."""
    from vidtrack.geometry.jacobian import derivatives

    pivot = POINTS.mean(0)
    names = tuple(n for n in PARAMETERS if n in ("f", "kappa1") or n.startswith(("omega", "t_")))
    at = derivatives(camera, POINTS, pivot)
    J = at.by_parameter[..., [PARAMETERS.index(n) for n in names]]
    sight = SIGHT**2 * np.eye(2) + at.by_point @ np.swapaxes(at.by_point, -1, -2) * sigma**2
    H = (np.swapaxes(J, -1, -2) @ np.linalg.inv(sight) @ J).sum(0)
    return Uncertain(names, pivot, np.linalg.inv(H))


def survey(sigma=SURVEY):
    return Survey(tuple(map(str, TAGS)), POINTS, np.full(len(POINTS), sigma), SIGHT)


def moving():
    rng = np.random.default_rng(4)
    p = rng.uniform(POINTS.min(0), POINTS.max(0), (2, 60, 3))
    b = np.stack([project(camera, p) for camera in CAMERAS])
    return p, b, np.full(b.shape, 0.05)


def budget(sigma=SURVEY, slips=None):
    p, b, sd = moving()
    known = [fitted(camera, sigma) for camera in CAMERAS]
    surveys = [survey(sigma)] * 2
    joint, part = joint_covariance(CAMERAS, known, surveys), survey_covariance(CAMERAS, known, surveys)
    return error_budget(CAMERAS, b, sd, known, joint, part, slips), known, joint, p


def test_the_parts_add_up_to_the_sigma_of_the_fixes():
    found, known, joint, _p = budget()
    _, b, sd = moving()
    sigma = locate_points(CAMERAS, b, sd=sd, uncertainties=known, joint=joint).sigma
    for i, axis in enumerate("xyz"):
        assert found["axes"][axis]["combined"] == pytest.approx(np.median(sigma[..., i]), rel=0.1)
    assert found["samples"] == 120


def test_an_exact_survey_has_no_part_and_a_coarse_one_rules():
    exact, coarse = budget(1e-9)[0]["axes"]["x"], budget(0.2)[0]["axes"]["x"]
    assert exact["survey"] < 1e-6 < exact["calibration"]
    assert coarse["survey"] > 3 * coarse["centroid"]
    assert coarse["centroid"] == pytest.approx(exact["centroid"])


def test_a_clock_that_is_not_known_has_its_part():
    _p, b, _ = moving()
    slips = np.full(b.shape, 0.3)
    slips[0] = 0.0
    axes = budget(slips=slips)[0]["axes"]
    assert max(own["clock"] for own in axes.values()) > 0.03
    assert budget()[0]["axes"]["x"]["clock"] == 0.0


def test_what_mixed_pictures_show_late_counts_as_the_clocks():
    _, b, sd = moving()
    aged = np.zeros((2, 60, 3, 3))
    aged[..., 1, 1] = 0.2**2
    axes = error_budget(CAMERAS, b, sd, [None, None], None, None, None, aged)["axes"]
    assert [axes[axis]["clock"] for axis in "xyz"] == pytest.approx([0.0, 0.2, 0.0])
    assert axes["y"]["combined"] == pytest.approx(np.hypot(axes["y"]["centroid"], 0.2))


def test_without_a_calibration_s_covariance_the_centroids_are_all_there_is():
    _, b, sd = moving()
    axes = error_budget(CAMERAS, b, sd, [None, None], None, None, None)["axes"]
    assert axes["x"]["combined"] == pytest.approx(axes["x"]["centroid"])
    nothing = error_budget(CAMERAS, b * np.nan, sd, [None, None], None, None, None)
    assert nothing["axes"] is None


def test_the_gradient_holds_the_displacements_that_wrong_calibrations_make():
    """Errors of the survey are drawn, and the displacement between two places measured with cameras that are off so."""
    _, known, joint, p = budget()
    G = calibration_field(CAMERAS, p, known, joint).gradients
    rng = np.random.default_rng(7)
    a = np.array([[-20.0, 0, 0], [20.0, 0, 0]])
    root = np.linalg.cholesky(joint + 1e-18 * np.diag(np.diag(joint)) + 1e-20 * np.eye(len(joint)))
    from vidtrack.geometry.jacobian import derivatives

    error = []
    for _ in range(150):
        off = root @ rng.normal(size=len(joint))
        b, at = [], 0
        for camera, u in zip(CAMERAS, known, strict=True):
            J = derivatives(camera, a, u.pivot).by_parameter[..., [PARAMETERS.index(n) for n in u.names]]
            b.append(project(camera, a) - J @ off[at : at + len(u.names)])
            at += len(u.names)
        found = locate_points(CAMERAS, np.stack(b), sd=1.0).point
        error.append((found[1] - found[0]) - (a[1] - a[0]))
    assert np.std(error, axis=0) == pytest.approx(40 * np.sqrt((G[:, :, 0] ** 2).sum(0)), rel=0.35)


def test_rounding_does_not_choose_among_the_errors_of_the_field():
    """Variances that are equal but for rounding have no eigenvectors of their own."""
    rng = np.random.default_rng(2)
    _, known, _, p = budget()
    sd = {"omega": 1e-4, "t_": 0.01, "f": 0.01, "kappa1": 1e-5}
    fields = []
    for share in (0.0, 1e-13, -1e-13):
        rough = []
        for u in known:
            size = np.array([next(v for k, v in sd.items() if name.startswith(k)) for name in u.names])
            noise = rng.normal(size=(len(size),) * 2)
            rough.append(
                Uncertain(u.names, u.pivot, np.outer(size, size) * (np.eye(len(size)) + share * (noise + noise.T)))
            )
        fields.append(calibration_field(CAMERAS, p, rough, None))
    first = fields[0]
    for other in fields[1:]:
        for one, two in zip(first, other, strict=True):
            np.testing.assert_allclose(two, one, rtol=0, atol=1e-9 * np.abs(one).max())
    size = (first.gradients**2).sum((1, 2))
    assert len(size) > 3
    assert size[0] > 2 * size[-1]


def test_the_errors_of_the_field_are_those_of_each_parameter_together():
    _, known, joint, p = budget()
    field = calibration_field(CAMERAS, p, known, joint)
    values, vectors = np.linalg.eigh(joint)
    several = []
    for value, v in zip(values, vectors.T, strict=True):  # one direction of the parameters at a time
        own = calibration_field(CAMERAS, p, known, value * np.outer(v, v))
        if value > 0 and own is not None:
            several.append((own.gradients**2).sum(0))
    np.testing.assert_allclose((field.gradients**2).sum(0), np.sum(several, axis=0), rtol=2e-3)


def test_a_parameter_that_others_settle_has_no_error_of_its_own():
    C = np.outer([1.0, 2e-3, 5.0], [1.0, 2e-3, 5.0]) + np.diag([0.0, 0.0, 1.0])
    root = _root(C)
    np.testing.assert_allclose(root @ root.T, C, rtol=1e-12)
    assert not root[:, 1].any()
    assert not _root(np.zeros((2, 2))).any()


def test_no_calibration_or_too_few_points_have_no_gradient():
    _, known, joint, p = budget()
    assert calibration_field(CAMERAS, p, [None, None], None) is None
    assert calibration_field(CAMERAS, p[0, :2], known, joint) is None
    unknown = [Uncertain(u.names, u.pivot, u.covariance * np.nan) for u in known]
    assert calibration_field(CAMERAS, p, unknown, None) is None
