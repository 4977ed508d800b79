"""What each job gets of the settings, and which cameras are calibrated at all."""

from dataclasses import replace

import pytest

from vidtrack.files.experiment import Clip, Experiment, Run
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow import orders, report_orders
from vidtrack.workflow.order_book import OrderBook


def config(**runs):
    return settings_from_config(
        {"units": "in", "cameras": {"cam1": None, "cam2": {"crop": [1, 2, 3, 4]}}, "runs": runs}
    )


def experiment(**runs):
    clip = Clip("row1", {"cam1": "a.png", "cam2": "b.png"}, None)
    made = {name: Run(name, {c: f"{c}.mov" for c in cameras}, None, None, None) for name, cameras in runs.items()}
    return Experiment(".", "points.csv", {"row1": clip}, made, {})


PLANE = {"mode": "plane", "plane": {"points": "calibration/points.csv"}}


@pytest.mark.parametrize(
    ("runs", "found", "calibrated"),
    [
        ({"r1": PLANE}, {"r1": ["cam1"]}, []),
        ({"r1": PLANE}, {"r1": ["cam1"], "r2": ["cam1", "cam2"]}, ["cam1", "cam2"]),
        ({}, {}, ["cam1", "cam2"]),
    ],
)
def test_a_camera_that_only_runs_in_a_plane_use_is_not_calibrated(runs, found, calibrated):
    assert orders.calibrated(config(**runs), experiment(**found)) == calibrated


def test_a_runs_crop_goes_before_its_cameras():
    both = {"r1": ["cam1", "cam2"]}
    assert orders.locate(config(), experiment(**both), "r1")["crop"] == {"cam2": (1, 2, 3, 4)}
    of_all = config(r1={"crop": [0, 0, 9, 9]})
    assert orders.locate(of_all, experiment(**both), "r1")["crop"] == dict.fromkeys(("cam1", "cam2"), (0, 0, 9, 9))
    of_one = config(r1={"crop": {"cam1": [0, 0, 9, 9]}})
    assert orders.locate(of_one, experiment(**both), "r1")["crop"] == {"cam1": (0, 0, 9, 9), "cam2": (1, 2, 3, 4)}


def test_who_says_nothing_of_flat_marks_has_the_orders_of_before():
    both, asked = {"r1": ["cam1", "cam2"]}, {"units": "in", "cameras": {"cam1": None, "cam2": None}}
    assert "flat" not in orders.locate(config(r1={}), experiment(**both), "r1")
    assert "flat" not in orders.calibrate(config(), "cam1")
    flat = settings_from_config({**asked, "calibration": {"flat": True}, "runs": {"r1": {"flat": True}}})
    assert orders.locate(flat, experiment(**both), "r1")["flat"] is True
    assert orders.calibrate(flat, "cam1")["flat"] is True


def test_targets_that_are_other_balls_are_said_to_be():
    both, asked = {"r1": ["cam1", "cam2"]}, {"units": "in", "cameras": {"cam1": None, "cam2": None}}
    assert "same_balls" not in orders.locate(config(r1={}), experiment(**both), "r1")
    other = settings_from_config({**asked, "calibration": {"same_balls": False}, "runs": {"r1": {}}})
    assert orders.locate(other, experiment(**both), "r1")["same_balls"] is False


def test_a_plane_is_located_by_the_sensor_where_the_config_gives_no_shape_of_a_pixel():
    def order(camera, **run):
        asked = {"units": "in", "cameras": {"cam1": camera}, "runs": {"r1": run}}
        return orders.locate(settings_from_config(asked), experiment(r1=["cam1"]), "r1")

    sensor = {"sensor": [8.8, 6.6]}
    assert order(sensor, **PLANE)["sensor"] == (8.8, 6.6)
    assert order(None, **PLANE)["sensor"] is None
    assert "sensor" not in order(sensor, mode="plane", plane={"scale": 0.1, "aspect": 1.25})
    assert "sensor" not in order(sensor)  # its cameras are calibrated: none is located again by it


def test_all_targets_are_asked_of_tracking_locating_and_the_verdict():
    found = experiment(r1=["cam1", "cam2"])
    asked = config(r1={"targets": "all"})
    assert orders.track(asked, found, "r1", "cam1")["targets"] == "all"
    assert orders.locate(asked, found, "r1")["targets"] == "all"
    assert report_orders.verdict(asked, found)["runs"]["r1"]["targets"] == "all"


def test_calibration_clips_depend_on_no_setting_of_moving_targets():
    found = replace(experiment(r=["cam1", "cam2"]), points=None)
    before = orders.calibration_points(config(), found, "cam1")
    moved = {"units": "in", "cameras": {"cam1": None, "cam2": None}, "detect": {"box": [90, 90], "max_step": 0.5}}
    after = orders.calibration_points(settings_from_config(moved), found, "cam1")
    assert after == before
    moved["detect"] = {"threshold": 90}
    assert orders.calibration_points(settings_from_config(moved), found, "cam1") != before


def orders_of(**changes):
    """Every order of the experiment, by its job."""
    these = settings_from_config({"units": "in", "cameras": {"cam1": {}, "cam2": {}}, **changes})
    found = checked_experiment(these)
    run = found.runs["pluck"]
    book = OrderBook(".", cache=".cache")
    book.add("track", orders.track(these, found, "pluck", "cam1"), [run.videos["cam1"]], "pluck", "cam1")
    book.add("calibrate", orders.calibrate(these, "cam1"), [], "cam1")
    book.add("calibrate", orders.calibrate(these, "cam2"), [], "cam2")
    book.add("calibration_points", orders.calibration_points(these, found, "cam1"), [], "cam1")
    book.add("locate", orders.locate(these, found, "pluck"), [], "pluck")
    book.add("compare", orders.compare(these, found, "pluck"), [run.reference], "pluck")
    return {" ".join(key): book.order(*key) for key in book.jobs}


def changed(before, after):
    return sorted(job for job in after if before[job] != after[job])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "touched"),
    [
        ({"cameras": {"cam1": {"Cx": 250}, "cam2": {}}}, ["calibrate cam1"]),
        ({"runs": {"pluck": {"threshold": 90}}}, ["track pluck cam1"]),
        ({"calibration": {"refine": "linear"}}, ["calibrate cam1", "calibrate cam2"]),
        ({"calibration": {"clips": {"row1": {"tags": "1-8"}}}}, []),
        ({"cameras": {"cam2": {}, "cam1": {}}}, []),
        ({"cameras": {"cam1": {"clock": {"offset_s": 1}}, "cam2": {}}}, ["locate pluck"]),
        ({"runs": {"pluck": {"reference": {"value": "x_in", "axis": "y"}}}}, ["compare pluck"]),
    ],
)
def test_a_setting_touches_the_orders_of_its_rules_alone(folder, changes, touched):
    assert changed(orders_of(), orders_of(**changes)) == touched


def test_asking_for_orders_writes_nothing(folder):
    before = sorted(folder.rglob("*"))
    orders_of()
    assert sorted(folder.rglob("*")) == before


@pytest.mark.slow
def test_an_edited_recording_is_seen_and_a_touched_one_is_not(folder):
    before = orders_of()
    (folder / "runs/pluck/cam1.mov").write_text("video")
    assert changed(before, orders_of()) == []
    (folder / "runs/pluck/cam1.mov").write_text("other")
    assert changed(before, orders_of()) == ["track pluck cam1"]
