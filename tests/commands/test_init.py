import pytest

from vidtrack.command import main


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
