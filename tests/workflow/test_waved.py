"""Which cameras a wand calibrates."""

from vidtrack.files.experiment import Clip, Experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.waved import wand_cameras, wand_clips


def _experiment(*clips):
    found = {name: Clip(name, dict.fromkeys(cameras, "x.mov"), None) for name, cameras in clips}
    return Experiment(".", None, found, {}, {})


def test_the_wands_clip_and_that_of_the_drop_are_no_clips_of_points():
    wand = {"lengths": {"A-B": 2}, "axes": {"drop": "fall"}}
    settings = settings_from_config({"units": "m", "cameras": {"a": {}, "b": {}}, "calibration": {"wand": wand}})
    assert wand_clips(settings) == ("wand", "fall")
    assert wand_cameras(settings, _experiment(("wand", ["a", "b"]), ("row", ["a"]))) == ["a", "b"]
    without = settings_from_config({"units": "m", "cameras": {"a": {}}})
    assert wand_clips(without) == ()
    assert wand_cameras(without, _experiment(("wand", ["a"]))) == []
