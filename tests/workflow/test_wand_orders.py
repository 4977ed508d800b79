"""The rules of a wand get the settings that they use, and no others."""

from vidtrack.files.experiment import Clip, Experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.orders import calibrated
from vidtrack.workflow.wand_orders import track_wand, wand


def _settings(**wand):
    own = {"lengths": {"A-B": 10, "B-C": 20}} | wand
    return settings_from_config(
        {
            "units": "mm",
            "cameras": {"a": {"sensor": [8, 6]}, "b": {"clock": "motion"}, "c": {}},
            "detect": {"threshold": 90},
            "calibration": {"wand": own},
        }
    )


def _experiment():
    clips = {
        "wand": Clip("wand", {"a": "1", "b": "2"}, None),
        "row": Clip("row", {"a": "3", "c": "4"}, None),
    }
    return Experiment(".", None, clips, {}, {})


def test_as_many_balls_are_followed_as_the_wand_has_with_its_own_detect():
    order = track_wand(_settings(detect={"threshold": 50}), _experiment(), "wand", "a")
    assert order["targets"] == 3
    assert order["detect"]["threshold"] == 50
    assert track_wand(_settings(axes={"drop": "fall"}), _experiment(), "row", "a")["targets"] == 1


def test_cameras_of_the_wand_are_not_calibrated_by_points_too():
    order = wand(_settings(), _experiment())
    assert list(order["cameras"]) == ["a", "b"]
    assert order["cameras"]["b"]["clock"] == "motion"
    assert order["bare"] == ["b"]
    assert calibrated(_settings(), _experiment()) == ["c"]


def test_one_length_is_a_wand_of_two_balls():
    settings = settings_from_config({"units": "mm", "cameras": {"a": {}}, "calibration": {"wand": {"length": 300}}})
    assert settings.calibration.wand.lengths == {"A-B": 300}
