from pathlib import Path

import pytest
import yaml

from vidtrack.arranging.arrangement import arranged
from vidtrack.arranging.folder import write_folder
from vidtrack.arranging.inventory import recordings_in
from vidtrack.files.experiment import look_through
from vidtrack.settings.config import settings_from_config

NAMES = ("pluck_cam1.mp4", "pluck_cam2.mp4", "calib_cam1.mp4", "calib_cam2.mp4")


@pytest.fixture
def videos(tmp_path, monkeypatch):
    for name in NAMES:
        (tmp_path / name).write_text(name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def experiment_here():
    return look_through(settings_from_config(yaml.safe_load(Path("config.yaml").read_text())))


@pytest.mark.parametrize("how", ["link", "copy", "move"])
def test_recordings_that_were_put_in_place_are_found_by_the_workflow(videos, how):
    write_folder(".", arranged(recordings_in(".")), "m", how)
    experiment, problems = experiment_here()
    assert not problems
    assert Path(experiment.runs["pluck"].videos["cam2"]).read_text() == "pluck_cam2.mp4"
    assert Path(experiment.clips["calib"].videos["cam1"]).read_text() == "calib_cam1.mp4"
    assert (videos / "pluck_cam1.mp4").exists() == (how != "move")


def test_recordings_that_are_left_are_named_in_the_config(videos):
    write_folder(".", arranged(recordings_in(".")), "m")
    experiment, problems = experiment_here()
    assert not problems
    assert experiment.runs["pluck"].videos == {"cam1": "pluck_cam1.mp4", "cam2": "pluck_cam2.mp4"}
    assert sorted(p.name for p in videos.iterdir()) == sorted([*NAMES, "calibration", "config.yaml"])


def test_nothing_is_overwritten(videos):
    (videos / "config.yaml").write_text("mine")
    (videos / "runs/pluck").mkdir(parents=True)
    (videos / "runs/pluck/cam1.mp4").write_text("mine too")
    done = write_folder(".", arranged(recordings_in(".")), "m", "copy")
    assert (videos / "config.yaml").read_text() == "mine"
    assert (videos / "runs/pluck/cam1.mp4").read_text() == "mine too"
    assert any("config.yaml" in line for line in done.left)


@pytest.mark.parametrize("how", ["link", "copy", "leave"])
def test_numbered_pictures_are_one_recording_for_the_workflow_too(tmp_path, monkeypatch, how):
    for n in range(6):
        for camera in ("cam1", "cam2"):
            (tmp_path / f"toss_{camera}_{n:03d}.png").write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    write_folder(".", arranged(recordings_in(".")), "m", how)
    experiment, problems = experiment_here()
    assert not problems
    (run,) = experiment.runs.values()
    assert len(run.recordings["cam2"].files) == 6
    if how != "leave":
        again = arranged(recordings_in(".")).of("run")[0].recordings["cam2"].path
        assert again.split("/")[:3] == ["runs", run.name, "cam2"]
