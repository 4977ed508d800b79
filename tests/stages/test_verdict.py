"""The verdict of an experiment: from records and tables to a word with reasons."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vidtrack.findings import Finding, as_records
from vidtrack.labelling.naming_doubts import MERGED, OUTSIDE
from vidtrack.results import CameraResults, Results, RunResults
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.verdict import CALIBRATING, _fit, _track, calibration_verdict, verdict

ASKED = {"pluck": {"mode": "space", "cameras": ["cam1", "cam2"], "targets": 1}}


def trajectories(lost=()):
    t = np.arange(300) / 30 + 36000.0
    x = np.where(np.isin(np.arange(300), lost), np.nan, 1.0)
    return pd.DataFrame({"time_s": t, "target": "t1", "x": x, "y": x, "z": x})


def camera(**record):
    return CameraResults({"camera": "cam1", "rms_px": 0.2, **record}, {"points": 64, "found": 64})


def experiment(**run):
    own = RunResults(tables={"trajectories": trajectories(run.pop("lost", ()))}, **run)
    return Results(cameras={"cam1": camera(), "cam2": camera()}, runs={"pluck": own})


def test_an_experiment_without_a_finding_is_good():
    record = verdict(experiment(), ASKED)
    assert record["verdict"] == "good"
    assert record["calibration"]["cameras"]["cam2"] == {"verdict": "good", "reasons": [], "notes": []}
    assert record["runs"]["pluck"]["reasons"] == []
    assert verdict(experiment(), ASKED, ["later"]) == record | {"awaited": ["later"]}


@pytest.mark.parametrize("name", ["locate", "clocks", "kinematics", "bodies", "comparison", "waterline", "anything"])
def test_a_finding_of_any_record_of_a_run_reaches_its_verdict(name):
    finding = Finding("bad", "x", "the lamp went out", "Film it again.")
    record = verdict(experiment(records={name: {"findings": as_records([finding])}}), ASKED)
    assert record["runs"]["pluck"]["verdict"] == record["verdict"] == "bad"
    assert record["runs"]["pluck"]["reasons"] == as_records([finding])
    assert record["calibration"]["verdict"] == "good"


def test_a_problem_of_one_recording_names_its_camera():
    reading = {"reading": {"problems": ["2 pictures are missing"]}}
    (reason,) = verdict(experiment(readings={"cam2": reading}), ASKED)["runs"]["pluck"]["reasons"]
    assert reason["text"] == "cam2: 2 pictures are missing"


def test_a_doubt_about_a_camera_is_the_cameras_the_calibrations_and_the_runs_that_use_it():
    results = experiment()
    results.cameras["cam2"] = camera(warnings=["cam2: tag 3 was left out. Check its name."])
    results.runs["flat"] = RunResults(tables={"trajectories": trajectories()})
    record = verdict(results, {**ASKED, "flat": {"mode": "plane", "cameras": ["cam2"], "targets": None}})
    assert record["calibration"]["cameras"]["cam1"]["verdict"] == "good"
    assert record["calibration"]["cameras"]["cam2"]["verdict"] == record["calibration"]["verdict"] == "doubtful"
    (reason,) = record["runs"]["pluck"]["reasons"]
    assert reason["text"] == "the calibration is doubtful: cam2: tag 3 was left out"
    assert reason["cure"] == "Check its name."
    assert record["runs"]["flat"]["verdict"] == "good"


def test_a_camera_that_moved_by_the_end_spoils_the_calibration_and_its_runs():
    results = experiment()
    results.stability = {"findings": as_records([Finding("bad", "camera-moved", "cam1: moved", "Lock it.")])}
    record = verdict(results, ASKED)
    assert record["calibration"]["verdict"] == record["runs"]["pluck"]["verdict"] == "bad"


def test_what_the_clips_after_the_test_gave_is_heard_too():
    results = experiment()
    results.after["cam1"] = CameraResults({"warnings": ["cam1: 9 points"]}, {"problems": ["clip too dark"]})
    texts = [reason["text"] for reason in verdict(results, ASKED)["calibration"]["reasons"]]
    assert texts == ["after the test: cam1: clip too dark", "after the test: cam1: 9 points"]


def test_a_run_whose_camera_failed_to_be_calibrated_has_failed_and_says_so():
    results = Results(cameras={"cam1": camera()}, failures=[failure("calibrate", "calibration", "cam2")])
    own = verdict(results, ASKED)["runs"]["pluck"]
    assert (own["verdict"], own["reasons"][0]["code"]) == ("failed", "calibration-failed")
    assert "the calibration of cam2 failed" in own["reasons"][0]["text"]


def test_a_run_of_which_nothing_came_has_failed_and_one_with_a_failed_job_says_why_alone():
    assert verdict(Results(), ASKED)["runs"]["pluck"]["reasons"][0]["code"] == "not-made"
    failed = Finding("failed", "locate-failed", "runs.pluck: no two cameras saw a target")
    results = Results(runs={"pluck": RunResults(records={"locate": {"findings": as_records([failed])}})})
    record = verdict(results, ASKED)
    half = verdict(experiment(lost=range(200), records={"compare": {"findings": as_records([failed])}}), ASKED)
    assert [reason["level"] for reason in half["runs"]["pluck"]["reasons"]] == ["failed", "bad"]
    assert record["runs"]["pluck"]["verdict"] == "failed"
    assert record["runs"]["pluck"]["reasons"] == as_records([failed])
    assert record["calibration"] is None


def failure(rule, *parts):
    return {"rule": rule, "parts": list(parts), "findings": as_records([Finding("failed", f"{rule}-failed", rule)])}


def test_a_job_that_failed_costs_its_run_or_its_camera_alone():
    results = experiment()
    results.failures = [failure("track", "pluck", "cam2")]
    results.runs["other"] = RunResults(tables={"trajectories": trajectories()})
    record = verdict(results, {**ASKED, "other": ASKED["pluck"]})
    assert [record["runs"][run]["verdict"] for run in ("pluck", "other")] == ["failed", "good"]
    assert record["calibration"]["verdict"] == "good"
    results.failures = [failure("calibrate", "calibration", "cam3")]
    record = verdict(results, ASKED)
    assert {name: own["verdict"] for name, own in record["calibration"]["cameras"].items()} == {
        "cam1": "good",
        "cam2": "good",
        "cam3": "failed",
    }
    assert record["runs"]["pluck"]["verdict"] == "good"
    results.failures = [failure("back_project")]
    record = verdict(results, ASKED)
    assert record["calibration"]["verdict"] == "failed"
    assert record["runs"]["pluck"]["verdict"] == "bad"


def test_lost_samples_are_counted_and_the_longest_gap_is_placed():
    track = _track(trajectories(lost=[*range(30, 60), 100]))
    assert (track.n, track.located) == (300, 269)
    assert track.gap_s == pytest.approx(1.0, abs=1e-6)
    assert track.gap_from_s == pytest.approx(36001.0, abs=1e-6)
    assert _track(trajectories()).gap_s == 0
    at_the_end = _track(trajectories(lost=range(285, 300)))
    assert at_the_end.gap_s == pytest.approx(0.5, abs=1e-6)
    assert _track(trajectories(lost=range(300))).located == 0


def fitted(noise_px, survey, stated):
    """The thesis's camera with 64 points: residuals by the true camera, so that no parameter takes any of them up."""
    rng = np.random.default_rng(5)
    own = thesis_rig()[0]
    p = thesis_points()[1]
    from vidtrack.geometry.camera import project

    residual = project(own, p + rng.normal(0, survey, p.shape)) - project(own, p) + rng.normal(0, noise_px, (64, 2))
    table = pd.DataFrame(
        {"x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "sigma": stated, "sd_x": noise_px, "sd_y": noise_px}
    )
    table["Xf"], table["used"] = 1.0, True
    table["residual_x"], table["residual_y"] = residual.T
    record = {"R": own.R.tolist(), "T": own.T.tolist(), "f": own.f, "dy": own.dy, "settings": {"sigma": 0.0}}
    return _fit(table, record)


def test_residuals_are_judged_by_centroid_noise_and_survey_tolerance_together():
    """The root of a reduced chi-squared of 128 terms: 1 +- 0.06, and as many times larger as sigma is understated."""
    assert fitted(0.02, 1 / 32, 1 / 32).misfit == pytest.approx(1.0, abs=0.2)
    assert fitted(0.02, 1 / 8, 1 / 32).misfit == pytest.approx(4.0, rel=0.2)
    assert np.isnan(fitted(0.02, 1 / 32, np.nan).misfit)


@pytest.mark.parametrize(
    ("rule", "parts", "camera"),
    [
        ("import_points", ["calibration", "cam2"], "cam2"),
        ("import_camera", ["cam2"], "cam2"),
        ("board_corners", ["cam2"], "cam2"),
        ("board_sightings", ["cam2"], "cam2"),
        ("boards", [], None),
        ("wand", ["calibration"], None),
    ],
)
def test_whatever_calibrates_a_camera_fails_its_calibration(rule, parts, camera):
    results = Results(cameras={"cam1": CameraResults(record={})}, failures=[failure(rule, *parts)])
    calibration = verdict(results, {})["calibration"]
    assert calibration["verdict"] == "failed"
    assert calibration["cameras"].get("cam2", {}).get("verdict") == ("failed" if camera else None)


def test_each_rule_of_the_calibration_is_known_as_one():
    here = Path(__file__).parents[2] / "workflow/rules"
    for name in ("calibration", "boards", "importing"):
        rules = re.findall(r"account\(\"(\w+)\"", (here / f"{name}.smk").read_text())
        assert rules
        assert set(rules) - {"import_tracks"} <= set(CALIBRATING)


@pytest.mark.parametrize(
    ("reason", "says"), [("the nearest blob is 9 px away", True), (MERGED, False), (OUTSIDE, False)]
)
def test_a_ball_that_no_camera_can_separate_or_see_is_no_evidence_against_its_survey(reason, says):
    points = pd.DataFrame({"tag": ["1", "2"], "found": [True, False], "reason": ["", reason]})
    results = experiment()
    cameras = {name: replace(own, points=points) for name, own in results.cameras.items()}
    record = verdict(replace(results, cameras=cameras), ASKED)
    codes = {reason["code"] for reason in record["calibration"]["reasons"]}
    assert ("points-found-by-no-camera" in codes) is says


def test_what_is_known_of_the_calibration_is_not_looked_for_again(monkeypatch):
    doubt = Finding("doubtful", "lens", "cam1: odd", "Look.")
    results = Results(cameras={"cam1": CameraResults(record={"findings": as_records([doubt])})})
    known = calibration_verdict(results)
    asked = {"mode": "space", "cameras": ["cam1"], "targets": None}
    whole = verdict(results, {"a": asked})
    assert known.cameras["cam1"].verdict == "doubtful"
    monkeypatch.setattr("vidtrack.stages.verdict._of_camera", None)
    assert verdict(results, {"a": asked}, of_calibration=known) == whole


def test_results_that_an_earlier_call_left_of_a_run_that_failed_now_are_named():
    places = ["calibration/backprojection.json", "runs/pluck/locate.json", "runs/pluck/trajectories.csv"]
    old = {"rule": "outdated", "parts": [], "findings": [], "outdated": places}
    results = Results(cameras={"cam1": camera()}, failures=[failure("locate", "pluck"), old])
    record = verdict(results, ASKED)
    assert record["outdated"] == places
    assert record["runs"]["pluck"]["verdict"] == "failed"
    (reason,) = [r for r in record["runs"]["pluck"]["reasons"] if r["code"] == "results-outdated"]
    assert reason["text"].startswith("trajectories.csv, locate.json in results/runs/pluck are of an earlier call")
