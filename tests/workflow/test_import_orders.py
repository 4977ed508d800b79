from vidtrack.files.experiment import Clip, Experiment, Run
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow import import_orders, orders

CONFIG = {
    "units": "in",
    "cameras": {
        "cam1": {"rate": 60, "tracks": {"origin": "lower-left", "size": [640, 480]}},
        "cam2": {"camera_file": {"path": "far/dlt.csv", "camera": 2, "lens": "far/profile.txt", "sigma_px": 0.2}},
    },
    "detect": {"sd": 0.3},
    "runs": {"r1": {"rate": 120, "tracks": {"origin": "upper-left"}, "targets": ["a", "b"]}},
}
SETTINGS = settings_from_config(CONFIG)


def experiment(folder="."):
    run = Run("r1", {"cam1": "cam1.csv", "cam2": "cam2.mov"}, None, None, None, tracks=frozenset(["cam1"]))
    other = Run("r2", dict(run.videos), None, None, None, tracks=frozenset(["cam1"]))
    clip = Clip("row1", {"cam1": "cam1.csv"}, None, digitised=frozenset(["cam1"]))
    runs = {"r1": run, "r2": other}
    return Experiment(folder, None, {"row1": clip}, runs, {}, given={"cam2": "far/cam2.ori"})


def test_what_is_said_of_a_run_goes_before_what_is_said_of_the_camera():
    order = import_orders.import_tracks(SETTINGS, experiment(), "r1", "cam1")
    assert order["tracks"] == {"origin": "upper-left", "size": (640, 480)}
    assert (order["rate"], order["sd"], order["names"]) == (120, 0.3, ["a", "b"])
    other = import_orders.import_tracks(SETTINGS, experiment(), "r2", "cam1")
    assert other["tracks"]["origin"] == "lower-left"
    assert (other["rate"], other["names"]) == (60, None)


def test_the_order_of_a_recording_has_no_sd_and_is_as_it_was():
    assert "sd" not in orders.track(SETTINGS, experiment(), "r1", "cam2")["detect"]


def test_a_run_of_tracks_has_as_many_targets_as_its_files_have():
    assert orders.locate(SETTINGS, experiment(), "r2")["targets"] == "all"
    assert orders.locate(SETTINGS, experiment(), "r1")["targets"] == ["a", "b"]


def test_a_camera_file_keeps_apart_its_camera_and_ours():
    order = import_orders.import_camera(SETTINGS, "cam2")
    assert (order["camera"], order["camera_in_file"], order["lens"]) == ("cam2", "2", "far/profile.txt")
    assert order["units"] == "in"
    assert order["sigma_px"] == 0.2


def test_all_files_of_a_camera_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far").mkdir()
    for name in ("cam2.ori", "cam2.addpar", "profile.txt"):
        (tmp_path / "far" / name).write_text("x")
    found = import_orders.files_of_camera(SETTINGS, experiment(), "cam2")
    assert found == ["far/cam2.ori", "far/cam2.addpar", "far/profile.txt"]


def test_digitised_points_have_the_sd_of_their_clip():
    order = import_orders.import_points(SETTINGS, experiment(), "cam1")
    assert order["clips"] == {"row1": {"tags": [], "sd": 0.3}}
    assert order["tracks"]["size"] == (640, 480)


def test_only_filmed_cameras_that_clips_calibrated_show_whether_they_stood_still():
    assert orders.steadiness(SETTINGS, experiment(), "r1")["cameras"] == []
    assert orders.clocks(SETTINGS, experiment(), "r1")["cameras"] == ["cam2"]
