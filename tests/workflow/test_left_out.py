"""Cameras that runs are located without."""

import json

import pytest

from tests.workflow.test_orders import PLANE, config, experiment
from vidtrack.workflow.left_out import NOTHING, LeftOut, also_left_out, from_environment, to_environment, without

THREE = ["cam1", "cam2", "cam3"]


@pytest.fixture
def failed(tmp_path):
    """The path of the record of a failure."""

    def written(rule, *parts):
        path = tmp_path / f"{rule}-{'-'.join(parts)}.json"
        path.write_text(json.dumps({"rule": rule, "parts": parts, "findings": []}))
        return str(path)

    return written


def test_a_camera_whose_calibration_failed_is_left_out_where_each_run_has_two_others(failed):
    record = failed("calibrate", "calibration", "cam3")
    left = also_left_out(config(), experiment(r1=THREE, r2=["cam1", "cam2"]), NOTHING, [record])
    assert left == LeftOut({"cam3": record}, {})
    assert left.of_run("r1") == {"cam3": "its calibration failed"}
    assert left.records == [record]


def test_a_camera_that_a_run_needs_is_not_left_out(failed):
    record = failed("calibrate", "calibration", "cam3")
    two = experiment(r1=THREE, r2=["cam1", "cam3"])
    assert also_left_out(config(), two, NOTHING, [record]) == NOTHING
    plane = experiment(r1=["cam3"], r2=THREE)
    assert also_left_out(config(r1=PLANE), plane, NOTHING, [record]) == NOTHING


def test_a_recording_that_failed_costs_its_own_run_alone(failed):
    record = failed("track", "r1", "cam2")
    whole = experiment(r1=THREE, r2=THREE, r3=["cam1", "cam2"])
    left = also_left_out(config(), whole, NOTHING, [record, failed("track", "r3", "cam2")])
    assert left.recordings == {"r1": {"cam2": record}}
    rest = without(whole, left)
    assert {name: list(run.videos) for name, run in rest.runs.items()} == {
        "r1": ["cam1", "cam3"],
        "r2": THREE,
        "r3": ["cam1", "cam2"],
    }


def test_a_second_failure_that_would_leave_one_camera_is_not_left_out(failed):
    first = failed("calibrate", "calibration", "cam3")
    whole = experiment(r1=THREE)
    left = also_left_out(config(), whole, NOTHING, [first])
    assert also_left_out(config(), whole, left, [failed("track", "r1", "cam2")]) == left


@pytest.mark.parametrize(
    "rule", [("locate", "r1"), ("calibrate", "calibration_after", "cam3"), ("bundle", "calibration")]
)
def test_what_is_no_failure_of_one_camera_leaves_nothing_out(failed, rule):
    assert also_left_out(config(), experiment(r1=THREE), NOTHING, [failed(*rule)]) == NOTHING


def test_without_runs_nothing_is_left_out(failed):
    assert also_left_out(config(), experiment(), NOTHING, [failed("calibrate", "calibration", "cam3")]) == NOTHING


def test_another_call_reads_what_one_hands_on():
    left = LeftOut({"cam 3": "results/x.json"}, {"r1": {"cam2": "results/y.json"}})
    assert from_environment(to_environment(left)) == left
    assert from_environment({}) == NOTHING
