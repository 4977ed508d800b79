"""What lies in an experiment folder is found by name; litter and links that lead nowhere are not taken for it."""

import pytest

from tests.files.folders import problems, settings, spoil
from vidtrack.files.experiment import look_through
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config


def test_what_lies_in_the_folder_is_found(folder):
    found = checked_experiment(settings())
    assert found.clips["row1"].videos == {"cam1": "calibration/row1/cam1.mov", "cam2": "calibration/row1/cam2.mov"}
    assert found.runs["pluck"].videos == {"cam1": "runs/pluck/cam1.mov", "cam2": "runs/pluck/cam2.MP4"}
    assert found.runs["pluck"].reference == "runs/pluck/reference.csv"
    assert found.results == "results"


def test_a_recording_elsewhere_is_found_by_its_path(folder):
    (folder / "tape").mkdir()
    (folder / "tape/a.avi").write_text("video")
    found = checked_experiment(settings(runs={"far": {"videos": {"cam1": "tape/a.avi", "cam2": "tape/a.avi"}}}))
    assert found.runs["far"].videos["cam1"] == "tape/a.avi"


@pytest.mark.parametrize(
    "name", ["Thumbs.db", ".DS_Store", "._cam1.mov", "cam1.SRT", "cam1.THM", "cam1.XML", "cam1.cih"]
)
def test_files_that_systems_and_cameras_leave_are_no_recordings(folder, name):
    (folder / "runs/pluck" / name).write_text("x")
    (folder / "runs/__MACOSX").mkdir()
    assert checked_experiment(settings()).runs["pluck"].videos["cam1"] == "runs/pluck/cam1.mov"


def test_a_recording_behind_a_broken_link_is_an_error_and_no_missing_camera(folder):
    (folder / "calibration/row1/cam3.mov").write_text("video")
    (folder / "runs/pluck/cam3.mov").symlink_to(folder / "disk/cam3.mov")
    (line,) = problems(cameras={"cam1": {}, "cam2": {}, "cam3": {}})
    assert line.startswith("runs/pluck/cam3.mov: a link to ")


def test_runs_whose_names_differ_in_capitals_alone_are_told(folder):
    for camera in ("cam1", "cam2"):
        spoil(folder, f"runs/PLUCK/{camera}.mov", "video")
    assert problems() == ["runs: PLUCK and pluck differ in capitals alone. Rename one of them."]


def test_cameras_whose_names_differ_in_capitals_alone_are_told(folder):
    (line,) = [line for line in problems(cameras={"cam1": {}, "cam2": {}, "CAM1": {}}) if "capitals" in line]
    assert line == "config.yaml: cameras: cam1 and CAM1 differ in capitals alone. Rename one of them."


def test_a_table_under_another_name_is_told_and_not_passed_over(folder):
    spoil(folder, "calibration/row1/picks.csv")
    spoil(folder, "calibration/row1/Picks.csv", "camera,tag,Xf,Yf\n")
    assert "Picks.csv: only picks.csv is read" in problems()[0]


def test_tracks_stand_in_place_of_a_recording_where_there_is_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path in ("runs/a/cam1.csv", "runs/a/cam2.mov", "runs/a/cam2.csv", "calibration/cam2.toml", "runs/a/notes.csv"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("x")
    (tmp_path / "calibration/row1").mkdir()
    (tmp_path / "calibration/row1/cam1.prn").write_text("x")
    settings = settings_from_config({"units": "in", "cameras": {"cam1": {}, "cam2": {}}})
    found, problems = look_through(settings)
    assert problems == []
    assert found.runs["a"].videos == {"cam1": "runs/a/cam1.csv", "cam2": "runs/a/cam2.mov"}
    assert found.runs["a"].tracks == {"cam1"}
    assert found.clips["row1"].digitised == {"cam1"}
    assert found.given == {"cam2": "calibration/cam2.toml"}


def test_a_file_of_tracks_elsewhere_may_serve_several_cameras(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "xypts.csv").write_text("x")
    cameras = {"cam1": {}, "cam2": {"camera_file": {"path": "missing.csv"}}}
    videos = {"cam1": "xypts.csv", "cam2": "xypts.csv"}
    settings = settings_from_config({"units": "in", "cameras": cameras, "runs": {"a": {"videos": videos}}})
    found, problems = look_through(settings)
    assert found.runs["a"].tracks == {"cam1", "cam2"}
    assert problems == ["config.yaml: cameras.cam2.camera_file.path: no such file as missing.csv. Correct the path."]


def test_two_files_of_one_camera_are_a_problem(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs/a").mkdir(parents=True)
    for name in ("cam1.csv", "cam1.h5"):
        (tmp_path / "runs/a" / name).write_text("x")
    problems = look_through(settings_from_config({"units": "in", "cameras": {"cam1": {}}}))[1]
    assert len(problems) == 1
    assert "camera cam1 has another file here" in problems[0]
