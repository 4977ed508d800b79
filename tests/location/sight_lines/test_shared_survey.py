"""A point surveyed wrongly moves all cameras alike."""

from typing import NamedTuple

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import Uncertainty, free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.shared_survey import Survey, joint_covariance, joint_of
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")


def calibrated(rng, n=2, sd=0.02, survey=0.1):
    tags, hung = thesis_points()
    p = hung + rng.normal(0, survey, hung.shape)
    fits = [
        refine(c, hung, project(c, p) + rng.normal(0, sd, (64, 2)), free=FREE, sd=sd, survey=survey)
        for c in thesis_rig(n)
    ]
    return (
        [f.camera for f in fits],
        [f.uncertainty for f in fits],
        [Survey(tuple(tags), hung, np.full(64, survey), sd)] * n,
    )


def test_each_cameras_own_covariance_stays_and_the_whole_is_one():
    cameras, known, surveys = calibrated(np.random.default_rng(0))
    joint = joint_covariance(cameras, known, surveys)
    k = len(FREE)
    assert joint[:k, :k] == pytest.approx(known[0].covariance)
    assert joint[k:, k:] == pytest.approx(known[1].covariance)
    assert joint == pytest.approx(joint.T)
    s = np.sqrt(np.diag(joint))
    assert np.linalg.eigvalsh(joint / s[:, None] / s)[0] > -1e-8


def test_cameras_that_share_no_point_or_an_exact_survey_err_independently():
    cameras, known, surveys = calibrated(np.random.default_rng(1))
    k = len(FREE)
    others = [surveys[0], surveys[1]._replace(tags=tuple(f"other {t}" for t in surveys[1].tags))]
    assert not joint_covariance(cameras, known, others)[:k, k:].any()
    exact = [s._replace(sigma=np.zeros(64)) for s in surveys]
    assert joint_covariance(cameras, known, exact)[:k, k:] == pytest.approx(np.zeros((k, k)))


def test_a_camera_without_an_uncertainty_is_passed_over():
    cameras, known, surveys = calibrated(np.random.default_rng(2))
    assert joint_covariance(cameras, [None, known[1]], surveys) == pytest.approx(known[1].covariance)


def test_what_the_survey_shares_makes_the_located_points_error_larger():
    # four cameras do not average away what all of them believe
    rng = np.random.default_rng(3)
    q = np.array([[10.0, 2, -3]])
    squares = []
    for _ in range(25):
        cameras, known, surveys = calibrated(rng, n=3)
        b = np.stack([project(c, q) for c in thesis_rig(3)])
        joint = joint_covariance(cameras, known, surveys)
        located = [locate_points(cameras, b, sd=0.001, uncertainties=known, joint=j) for j in (joint, None)]
        squares.append([np.mean(((x.point - q) / x.sigma) ** 2) for x in located])
    with_survey, independent = np.mean(squares, 0)
    assert 0.6 < with_survey < 1.4  # 25 trials of three correlated coordinates
    assert independent > 1.4 * with_survey


class _Read(NamedTuple):
    """A camera with the record of its camera.json."""

    record: dict


def test_a_covariance_that_one_calibration_recorded_of_all_cameras_is_taken_in_the_runs_order():
    whole = np.diag([1.0, 2, 3, 4]) + 0.1
    joint = {"cameras": ["a", "b"], "names": [["f", "Cx"], ["f", "Cx"]], "covariance": whole.tolist()}
    read = [_Read({"camera": name, "joint": joint}) for name in ("b", "a")]
    known = [Uncertainty(("f", "Cx"), np.zeros(3), whole[k : k + 2, k : k + 2]) for k in (2, 0)]
    found = joint_of(read, [], known, None)
    np.testing.assert_allclose(found, whole[np.ix_([2, 3, 0, 1], [2, 3, 0, 1])])
    # pictures of another size have other parameters, and cameras of two calibrations nothing in common
    other = known[0]._replace(covariance=4 * known[0].covariance)
    assert joint_of(read, [], [other, known[1]], None) is None
    assert joint_of([read[0], _Read({"camera": "a"})], [], known, None) is None
