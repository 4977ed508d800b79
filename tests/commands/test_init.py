import os
import pty
import subprocess
import sys

import pytest
import yaml

from tests.arranging.test_continuation import film
from vidtrack.command import main
from vidtrack.files.experiment import look_through
from vidtrack.settings.config import settings_from_config
from vidtrack.video.reader import open_video


@pytest.fixture
def videos(tmp_path):
    for name in ("pluck_cam1.mp4", "pluck_cam2.mp4", "calib_cam1.mp4", "calib_cam2.mp4"):
        (tmp_path / name).write_text("x")
    return tmp_path


def test_a_config_and_the_header_of_points_are_written_and_what_is_left_to_do_is_said(videos, capsys):
    assert main(["init", str(videos), "--units", "m", "--link"]) == 0
    said = capsys.readouterr().out
    assert "cameras: cam1, cam2" in said
    assert "to do: write the surveyed points" in said
    assert (videos / "calibration/points.csv").read_text() == "tag,x,y,z,sigma\n"
    assert "\nunits: m\n" in (videos / "config.yaml").read_text()


def test_a_dry_run_writes_nothing(videos, capsys):
    before = sorted(videos.iterdir())
    assert main(["init", str(videos), "--dry-run"]) == 0
    assert "runs: pluck" in capsys.readouterr().out
    assert sorted(videos.iterdir()) == before


def test_without_a_terminal_the_unit_must_be_given(videos, capsys):
    assert main(["init", str(videos)]) == 1
    assert "--units" in capsys.readouterr().err
    assert not (videos / "config.yaml").exists()


def test_a_folder_without_recordings_is_refused(tmp_path, capsys):
    assert main(["init", str(tmp_path), "--units", "m"]) == 1
    assert "no recording in it" in capsys.readouterr().err


def test_clips_that_stay_elsewhere_are_said_to_be_out_of_place(videos, capsys):
    assert main(["init", str(videos), "--units", "m"]) == 0
    assert "Call again with --link" in capsys.readouterr().out


def test_a_second_call_changes_nothing(videos, capsys):
    main(["init", str(videos), "--units", "m", "--link"])
    before = {p: p.read_bytes() for p in videos.rglob("*") if p.is_file()}
    assert main(["init", str(videos), "--units", "in", "--link"]) == 0
    assert {p: p.read_bytes() for p in videos.rglob("*") if p.is_file()} == before


@pytest.fixture
def split(tmp_path):
    """Two cameras whose recordings of a run and of the points were split into two files each, by time code."""
    for camera in ("cam1", "cam2"):
        for take, hour in (("pluck", 10), ("calib", 9)):
            for k in (1, 2):
                film(tmp_path / f"{take}_{camera}_{k}.mov", n=25, code=f"{hour:02d}:00:{k:02d}:00")
    return tmp_path


@pytest.mark.parametrize("how", ["--link", "--copy", "--move"])
def test_files_of_one_recording_are_joined_and_the_workflow_reads_them_as_one(split, capsys, monkeypatch, how):
    assert main(["init", str(split), "--units", "m", how, "--yes"]) == 0
    said = capsys.readouterr().out
    assert "cameras: cam1, cam2" in said
    assert "pluck_cam1_1.mov, pluck_cam1_2.mov: taken for one recording, by time code" in said
    monkeypatch.chdir(split)
    settings = settings_from_config(yaml.safe_load((split / "config.yaml").read_text()))
    experiment, problems = look_through(settings)
    assert problems == []
    assert list(experiment.runs) == ["pluck"]
    assert list(experiment.clips) == ["calib"]
    own = experiment.runs["pluck"].recordings["cam2"]
    with open_video(own.path, parts=own.parts) as video:
        assert sum(1 for _ in video.frames()) == 50
        assert video.account.problems == ()


def test_files_that_are_named_as_an_experiment_has_parts_stay_where_they_are(tmp_path, capsys):
    for camera in ("cam1", "cam2"):
        for k in (1, 2):
            film(tmp_path / f"runs/pluck/{camera}_{k}.mov", n=25, code=f"10:00:{k:02d}:00")
    assert main(["init", str(tmp_path), "--units", "m", "--link"]) == 0
    said = capsys.readouterr().out
    assert "cameras: cam1, cam2" in said
    assert "link: " not in said


def test_joining_can_be_forbidden_and_asked_for(split, capsys):
    assert main(["init", str(split), "--no-join", "--dry-run"]) == 0
    assert "taken for one recording" not in capsys.readouterr().out
    assert main(["init", str(split), "--no-join", "--join", "pluck_*", "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "pluck_cam1_1.mov and 1 more (chapters)" in said
    assert "calib_cam1_1.mov and 1 more" not in said
    assert main(["init", str(split), "--join", "dive_*", "--dry-run"]) == 1
    assert "--join dive_*: finds no files" in capsys.readouterr().err


def asked(folder, answers):
    """What `vidtrack init` says on a terminal where a person gives these answers; its exit code."""
    master, slave = pty.openpty()
    command = [sys.executable, "-m", "vidtrack.command", "init", str(folder)]
    with subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, start_new_session=True) as child:
        os.close(slave)
        os.write(master, "".join(f"{answer}\n" for answer in answers).encode())
        said = b""
        while True:
            try:
                part = os.read(master, 4096)
            except OSError:
                break
            said += part
    os.close(master)
    return said.decode().replace("\r", ""), child.returncode


def test_on_a_terminal_it_asks_for_what_it_cannot_know(tmp_path):
    for camera in ("cam1", "cam2"):
        for k in (1, 2):
            film(tmp_path / f"pluck_{camera}_part{k}.mov", n=4)
    said, code = asked(tmp_path, ["yes", "no", "furlong", "mm", "copy", "y"])
    assert code == 0
    assert "are these parts of one recording?" in said
    assert "unit of every length" in said
    assert "'furlong' is not one of" in said
    assert "link, copy, move" in said
    assert "units: mm" in (tmp_path / "config.yaml").read_text()
    assert sorted(os.listdir(tmp_path / "runs")) == ["pluck", "pluck-part1", "pluck-part2"]  # cam1 joined, cam2 not
    assert not (tmp_path / "runs/pluck/cam1/pluck_cam1_part1.mov").is_symlink()


def test_on_a_terminal_nothing_is_written_where_a_person_says_no(videos):
    said, code = asked(videos, ["m", "link", "n"])
    assert code == 1
    assert "Write this?" in said
    assert not (videos / "config.yaml").exists()
