"""What is known of a camera before anything runs, whatever it is calibrated by."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from tests.exchange.thesis.folder import write_old
from tests.simulate.test_board_picture import shown
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen
from vidtrack.command import main
from vidtrack.files.experiment import look_through
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.preview.survey import survey
from vidtrack.preview.views import opened_with, view_of
from vidtrack.settings.config import settings_from_config

LENS = {"fx": 530.0, "cx": 255.5, "cy": 239.5}
BOARD = {"type": "charuco", "columns": 8, "rows": 6, "square": 30}
WAND = {"lengths": {"A-B": 20.0}, "axes": "camera"}


def filmed(folder, clip, config, monkeypatch):
    """An experiment of two cameras whose only clip is two dark pictures each."""
    for camera in ("cam1", "cam2"):
        (folder / "calibration" / clip / camera).mkdir(parents=True)
        for k in range(2):
            cv2.imwrite(str(folder / "calibration" / clip / camera / f"{k}.png"), np.full((48, 64), 20, np.uint8))
    config = {"units": "mm", "cameras": {"cam1": {"rate": 30}, "cam2": {"rate": 30}}} | config
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    monkeypatch.chdir(folder)
    settings = settings_from_config(config)
    return settings, checked_experiment(settings)


@pytest.mark.parametrize(
    ("clip", "calibration", "by"),
    [
        ("wand", {"wand": WAND}, "the wand in calibration/wand"),
        ("board", {"board": BOARD}, "the charuco board in calibration/board (8 x 6, squares of 30 mm)"),
    ],
)
def test_a_wand_or_a_board_needs_no_surveyed_points(clip, calibration, by, tmp_path, monkeypatch):
    settings, experiment = filmed(tmp_path, clip, {"calibration": calibration}, monkeypatch)
    found = survey(settings, experiment, 1, lambda what: None)
    assert not [finding for finding in found.findings if finding.level == "failed"]
    assert [what for about, what in found.facts if about == "calibration, cam1"] == [
        f"calibrated by {by}; the run says how well"
    ]
    assert opened_with(settings, experiment, "clip", clip, "cam1") == {"rate": 30, "numbered": True}


@pytest.mark.slow
def test_a_known_lens_is_held_as_in_the_workflow(lab, monkeypatch):
    config = yaml.safe_load((lab / "config.yaml").read_text())
    config["calibration"]["lens"] = LENS
    monkeypatch.chdir(lab)
    settings = settings_from_config(config)
    found = survey(settings, checked_experiment(settings), 1, lambda what: None)
    assert any("the lens is that of" in finding.text for finding in found.findings)


def test_a_lens_of_another_shape_is_a_problem_of_the_camera(lab, monkeypatch):
    from itertools import islice

    from vidtrack.preview.views import Few
    from vidtrack.video.reader import open_video

    def read(clip, path, how):
        with open_video(path, **how) as video:
            return Few(list(islice(video.frames(), 1)), (video.info.width, video.info.height), video.info.bits)

    (lab / "lens.yml").write_text(
        "image_width: 1920\nimage_height: 400\n"
        "camera_matrix: {rows: 3, cols: 3, data: [900, 0, 960, 0, 900, 200, 0, 0, 1]}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
    )
    config = yaml.safe_load((lab / "config.yaml").read_text())
    config["calibration"]["lens"] = "lens.yml"
    monkeypatch.chdir(lab)
    settings = settings_from_config(config)
    view = view_of(settings, checked_experiment(settings), "cam1", read)
    assert view.calibration is None
    assert any("lens.yml" in problem for problem in view.problems)


def test_files_of_other_programs_are_read_as_the_workflow_reads_them(tmp_path, monkeypatch):
    (tmp_path / "old").mkdir()
    write_old(tmp_path / "old")
    assert main(["import", str(tmp_path / "old"), str(tmp_path / "lab"), "--units", "in"]) == 0
    monkeypatch.chdir(tmp_path / "lab")

    def looked_at():
        config = yaml.safe_load(Path("config.yaml").read_text())
        settings = settings_from_config(config)
        return survey(settings, checked_experiment(settings), 1, lambda what: None)

    facts = looked_at().facts
    assert ("calibration, cam1", "31 points that were digitised (thesis)") in facts
    assert ("run run, cam2", "tracks of another program (thesis): 1 targets, 60 positions") in facts
    for path, left in (("calibration/balls/cam1.prn", 700), ("runs/run/cam2.prn", 500)):
        Path(path).write_bytes(Path(path).read_bytes()[:left])
    refused = [finding.text for finding in looked_at().findings if finding.level == "failed"]
    assert [text.split(":")[0] for text in refused] == ["calibration, cam1", "run run, cam2"]


def test_a_board_is_looked_for_in_a_few_pictures(tmp_path, monkeypatch):
    board = {"type": "charuco", "columns": 7, "rows": 5, "square": 30}
    settings, experiment = filmed(tmp_path, "board", {"calibration": {"board": board}}, monkeypatch)
    assert [f.code for f in survey(settings, experiment, 1, lambda what: None).findings] == ["board-not-found"] * 2
    picture, _ = shown("charuco")
    corners = len(board_seen(Board("charuco", 7, 5, 30.0), picture).ids)
    for camera in ("cam1", "cam2"):
        for k in range(2):
            cv2.imwrite(str(tmp_path / "calibration/board" / camera / f"{k}.png"), picture)
    found = survey(settings, experiment, 1, lambda what: None)
    said = [what for about, what in found.facts if about == "calibration, cam1"]
    assert said[1] == f"the board is seen in 2 of 2 pictures looked at, {corners} corners each"
    assert not found.findings


def test_a_camera_of_another_program_is_read_as_the_workflow_reads_it(tmp_path, monkeypatch):
    (tmp_path / "runs/a").mkdir(parents=True)
    (tmp_path / "rig.toml").write_text(
        '[cam_0]\nname = "cam1"\nsize = [640, 480]\nmatrix = [[800.0, 0, 320.0], [0, 800.0, 240.0], [0, 0, 1]]\n'
        "distortions = [0.0, 0, 0, 0, 0]\nrotation = [0.0, 0, 0]\ntranslation = [0.0, 0, 500.0]\n"
    )
    config = {"units": "mm", "cameras": {"cam1": {"camera_file": {"path": "rig.toml", "sigma_px": 0.2}}}}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(config))
    monkeypatch.chdir(tmp_path)
    settings = settings_from_config(config)
    experiment = look_through(settings)[0]
    facts = survey(settings, experiment, 1, lambda what: None).facts
    said = "calibrated by another program (anipose); it stands at (0, 0, -500); known to 0.2 px"
    assert [what.replace("-0,", "0,") for about, what in facts if about == "calibration, cam1"] == [said]
    (tmp_path / "rig.toml").write_text("[cam_0]\nname = 'cam1'\n")
    (refused,) = survey(settings, experiment, 1, lambda what: None).findings
    assert (refused.level, refused.text.split(":")[0]) == ("failed", "calibration, cam1")
