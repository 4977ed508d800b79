"""What the config says of one run, clip or camera, before the camera's own settings and the defaults."""

import pytest

from tests.workflow.test_orders import config, experiment
from vidtrack.files.experiment import Clip
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.own_settings import (
    clock_of,
    crop_of,
    detect_of_clip,
    own_of,
    recording_of,
    targets_of,
    without_colour,
)


def test_a_run_that_the_config_does_not_name_has_the_defaults():
    assert own_of(config(), "r1") == own_of(config(r2={"targets": 3}), "r1")
    assert own_of(config(r1={"targets": 3}), "r1").targets == 3


@pytest.mark.parametrize(("own", "targets"), [({}, 1), ({"targets": 3}, 3), ({"targets": "all"}, "all")])
def test_without_a_word_a_run_has_one_target(own, targets):
    assert targets_of(config(r1=own), experiment(r1=["cam1"]).runs["r1"]) == targets


def test_targets_with_names_are_given_by_them():
    assert targets_of(config(r1={"targets": ["bow", "stern"]}), experiment(r1=["cam1"]).runs["r1"]) == ["bow", "stern"]


def test_the_rate_of_a_run_goes_before_that_of_its_camera():
    cameras = {"cam1": {"rate": 25}, "cam2": None}
    settings = settings_from_config({"units": "in", "cameras": cameras, "runs": {"r1": {"rate": {"cam2": 50}}}})
    run = experiment(r1=["cam1", "cam2"]).runs["r1"]
    assert recording_of(settings, run, "cam1") == {"rate": 25}
    assert recording_of(settings, run, "cam2") == {"rate": 50}
    assert recording_of(settings, Clip("row1", {"cam2": "b.png"}, None), "cam2") == {}


def test_the_rate_of_a_clip_goes_before_that_of_its_camera():
    cameras = {"cam1": {"rate": 25}, "cam2": None}
    clips = {"waved": {"rate": 240}}
    settings = settings_from_config({"units": "in", "cameras": cameras, "calibration": {"clips": clips}})
    for camera in cameras:
        assert recording_of(settings, Clip("waved", {camera: "b.mp4"}, None), camera) == {"rate": 240}
    assert recording_of(settings, Clip("row1", {"cam1": "b.mp4"}, None), "cam1") == {"rate": 25}


def test_the_crop_of_a_run_goes_before_that_of_its_camera():
    assert crop_of(config(), "r1", "cam1") is None
    assert crop_of(config(), "r1", "cam2") == (1, 2, 3, 4)
    assert crop_of(config(r1={"crop": [0, 0, 9, 9]}), "r1", "cam2") == (0, 0, 9, 9)


def test_detect_settings_of_a_clip_go_before_those_of_all():
    settings = settings_from_config(
        {
            "units": "in",
            "cameras": {"cam1": None},
            "detect": {"threshold": 90},
            "calibration": {"clips": {"row1": {"detect": {"threshold": 120}}}},
        }
    )
    assert detect_of_clip(settings, "row1")["threshold"] == 120
    assert detect_of_clip(settings, "row2")["threshold"] == 90


def test_colour_is_for_the_reader_and_no_stage_gets_it():
    assert without_colour({"colour": "red", "sd": 1.0, "box": 3}) == {"box": 3}


def test_a_clock_is_a_word_or_offset_and_rate():
    cameras = {"cam1": {"clock": "auto"}, "cam2": {"clock": {"offset_s": 1.5}}, "cam3": None}
    settings = settings_from_config({"units": "in", "cameras": cameras})
    assert clock_of(settings, "cam1") == "auto"
    assert clock_of(settings, "cam2") == {"offset_s": 1.5, "rate_ppm": 0.0}
    assert clock_of(settings, "cam3") is None
