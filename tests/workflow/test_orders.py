"""What each job gets of the settings, and which cameras are calibrated at all."""

from dataclasses import replace

import pytest

from vidtrack.files.experiment import Clip, Experiment, Run
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow import orders


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
        ({"r1": PLANE}, {"r1": ["cam1"]}, ["cam2"]),
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


def test_calibration_clips_depend_on_no_setting_of_moving_targets():
    found = replace(experiment(r=["cam1", "cam2"]), points=None)
    before = orders.calibration_points(config(), found, "cam1")
    moved = {"units": "in", "cameras": {"cam1": None, "cam2": None}, "detect": {"box": [90, 90], "max_step": 0.5}}
    after = orders.calibration_points(settings_from_config(moved), found, "cam1")
    assert after == before
    moved["detect"] = {"threshold": 90}
    assert orders.calibration_points(settings_from_config(moved), found, "cam1") != before
