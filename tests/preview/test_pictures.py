"""Pictures of a run that are not those of the calibration are named before anything runs."""

from types import SimpleNamespace

import pytest

from tests.workflow.test_orders import config
from vidtrack.geometry.picture_part import Picture
from vidtrack.preview.pictures import other_pictures, picture_of

CALIBRATED = {"cam1": Picture(640, 480), "cam2": Picture(640, 480)}


def info(width, height, aspect=1, rotation=0):
    return SimpleNamespace(width=width, height=height, sample_aspect=aspect, rotation=rotation)


@pytest.mark.parametrize(
    ("recorded", "level"),
    [
        (info(640, 480), None),
        (info(320, 240), "doubtful"),
        (info(640, 360), "failed"),
        (info(480, 640, rotation=90), "failed"),
    ],
)
def test_only_the_same_picture_goes_without_a_word(recorded, level):
    found = other_pictures(config(), "r1", CALIBRATED, {"cam1": recorded})
    assert ([one.level for one in found] or [None])[0] == level
    assert all("cam1" in one.text for one in found)


def test_a_crop_of_the_config_says_what_a_picture_shows():
    assert other_pictures(config(r1={"crop": [0, 60, 640, 360]}), "r1", CALIBRATED, {"cam1": info(640, 360)}) == []


def test_cameras_whose_calibration_has_no_picture_are_passed_over():
    assert other_pictures(config(), "r1", {}, {"cam1": info(3, 5)}) == []


def test_a_picture_is_taken_as_a_player_turns_it():
    assert picture_of(info(480, 640, 2, 90)) == Picture(480, 640, 2, 90)
