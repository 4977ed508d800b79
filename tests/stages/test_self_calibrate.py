"""A floating body refines the cameras where it helps; a body that is not as stated is named and not followed."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.self_calibration import BODY, WET_BODY, behind, errors, floated, surveyed
from vidtrack.errors import VidtrackError
from vidtrack.location.sight_lines.shared_survey import joint_covariance, surveys_of
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.self_calibrate import self_calibrate


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(3)
    truth = list(thesis_rig(2))
    calibrated, points = surveyed(truth, rng, 20, 1 / 32, 0.1)
    return truth, calibrated, points, floated(truth, rng, 120, 0.1)


def _refine(scene, body=BODY, **changes):
    _, calibrated, points, seen = scene
    given = {"points": points, "sigma": 0.001, "body": "float"} | changes
    return self_calibrate({"heave": given.pop("seen", seen)}, given.pop("calibrated", calibrated), body, **given)


def test_a_survey_of_a_32nd_of_an_inch_gains_by_a_body_and_sigma_stays_honest(scene):
    truth, calibrated, points, _ = scene
    done = _refine(scene)
    assert done.used
    assert [f.code for f in done.findings] == ["self-calibration-used"]
    first, known = [own[0] for own in calibrated.values()], [own[1] for own in calibrated.values()]
    q = np.random.default_rng(9).uniform(-15, 15, (200, 3))
    joint = joint_covariance(first, known, surveys_of(first, list(points.values()), 0.1))
    before = errors(first, known, joint, q, truth, np.zeros((2, 200, 2)))
    after = errors(
        list(done.cameras), list(done.uncertainties), done.joint["covariance"], q, truth, np.zeros((2, 200, 2))
    )
    assert after[1] < 0.4 * before[1], "beyond a rigid motion, which a body says nothing of"
    assert after[0] < before[0] * 1.05
    assert 0.3 < np.sqrt(after[3]) < 2  # one draw of the survey: benchmarks/self_calibration.py has the mean of many
    assert done.record["sigma_of_calibration"]["after"] < done.record["sigma_of_calibration"]["before"]


@pytest.mark.parametrize(("target", "axis", "off"), [("bow", 0, 0.5), ("mast", 2, -0.4), ("port", 1, 25.4 * 9)])
def test_a_coordinate_that_is_mistyped_is_named_and_the_cameras_stay(scene, target, axis, off):
    wrong = {name: list(place) for name, place in BODY.items()}
    wrong[target][axis] += off
    done = _refine(scene, wrong)
    assert not done.used
    assert done.cameras[0] is next(iter(scene[1].values()))[0]
    assert [f.code for f in done.findings] == ["body-distances-wrong"]
    assert target in done.findings[0].text


def test_a_body_in_another_unit_is_said_to_be_wrong_in_all_its_lengths(scene):
    done = _refine(scene, {name: np.array(place) * 1.02 for name, place in BODY.items()})
    assert not done.used
    assert "too large" in done.findings[0].text


@pytest.mark.parametrize("when", [0.3, 2.0])
def test_a_target_that_slips_during_the_run_is_named(scene, when):
    slipped = scene[3].copy()
    late = (slipped["target"] == "bow") & (slipped["time_s"] > when)
    slipped.loc[late, ["Xf", "Yf"]] += [3.0, 2.0]
    done = _refine(scene, seen=slipped)
    assert not done.used
    assert {f.code for f in done.findings} <= {"body-not-rigid", "body-distances-wrong"}
    assert "bow" in done.findings[0].text


def test_cameras_that_are_exact_already_are_left_as_they_are(scene):
    truth = scene[0]
    calibrated = {
        name: (camera, own[1]._replace(covariance=own[1].covariance * 1e-8))
        for camera, (name, own) in zip(truth, scene[1].items(), strict=True)
    }
    done = _refine(scene, calibrated=calibrated, points=None)
    assert not done.used
    assert [(f.level, f.code) for f in done.findings] == [("note", "self-calibration-no-help")]


def test_a_body_seen_too_briefly_leaves_the_cameras_and_says_so(scene):
    seen = scene[3]
    done = _refine(scene, seen=seen[seen["time_s"] < 1])
    assert not done.used
    assert "30 moments" in done.findings[0].text


def test_what_cannot_be_weighed_is_refused_in_one_line(scene):
    calibrated = scene[1]
    name = next(iter(calibrated))
    unknown = calibrated | {name: (calibrated[name][0], None)}
    with pytest.raises(VidtrackError, match="uncertainty of cam0's calibration is not known"):
        _refine(scene, calibrated=unknown)
    with pytest.raises(VidtrackError, match="three at known distances"):
        _refine(scene, dict(list(BODY.items())[:2]))
    with pytest.raises(VidtrackError, match="on one line"):
        _refine(scene, {"bow": [0, 0, 0], "port": [1, 1, 0], "mast": [3, 3, 0]})


def test_targets_of_no_body_and_cameras_of_no_calibration_are_passed_over(scene):
    seen = scene[3]
    more = pd.concat([seen, seen[seen["target"] == "bow"].assign(target="buoy"), seen.assign(camera="other")])
    assert _refine(scene, seen=more).record["held_out"] == _refine(scene).record["held_out"]


@pytest.fixture(scope="module")
def wet():
    return behind("window", np.random.default_rng(0), 60)


def test_cameras_behind_a_window_gain_by_a_body_in_the_water_and_sigma_stays_honest(wet):
    """benchmarks/self_calibration.py --behind has the mean of many, and cameras above the surface, and tank walls."""
    truth, calibrated, points, seen = wet
    done = self_calibrate({"heave": seen}, calibrated, WET_BODY, points=points, sigma=0.02, body="float", units="mm")
    assert [f.code for f in done.findings] == ["self-calibration-used"]
    first, known = [own[0] for own in calibrated.values()], [own[1] for own in calibrated.values()]
    q = np.random.default_rng(9).uniform([-120, -120, -120], [120, 120, 60], (100, 3))
    joint = joint_covariance(first, known, surveys_of(first, list(points.values()), 0.1))
    nothing = np.zeros((2, 100, 2))
    before = errors(first, known, joint, q, truth, nothing)
    after = errors(list(done.cameras), list(done.uncertainties), done.joint["covariance"], q, truth, nothing)
    assert after[1] < 0.3 * before[1], "beyond a rigid motion, which a body says nothing of"
    assert after[0] < before[0]
    assert 0.3 < np.sqrt(after[3]) < 2  # one draw of the survey
    window = [camera.through[0] for camera in done.cameras]
    assert not window[0].deviation(window[1]).any(), "one window for both"
    assert {"window.position", "window.index_2"} <= set(done.uncertainties[1].names)


def test_behind_a_window_a_coordinate_that_is_mistyped_is_named_and_the_cameras_stay(wet):
    _, calibrated, points, seen = wet
    wrong = WET_BODY | {"mast": [10.0, 15, 95]}
    done = self_calibrate({"heave": seen}, calibrated, wrong, points=points, sigma=0.02)
    assert [f.code for f in done.findings] == ["body-distances-wrong"]
    assert "mast" in done.findings[0].text


def test_behind_a_window_cameras_that_no_points_calibrated_stay_and_it_is_said(wet):
    _, calibrated, _, seen = wet
    done = self_calibrate({"heave": seen}, calibrated, WET_BODY, sigma=0.02)
    assert not done.used
    assert "surveyed points calibrated" in done.findings[0].text
