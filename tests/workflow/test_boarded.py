"""Which board each clip shows, and that all clips show one and the same."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Clip, Experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.boarded import board_clips, board_corners, boards

BOARD = {"type": "charuco", "columns": 8, "rows": 6, "square": 30}
SETTINGS = settings_from_config({"units": "mm", "cameras": {"cam1": {}}, "calibration": {"board": BOARD}})


def experiment(points=None, **own):
    clips = {name: Clip(name, {"cam1": f"{name}/cam1.mp4"}, None, board=path) for name, path in own.items()}
    return Experiment(".", points, clips, {}, {})


def test_without_surveyed_points_every_clip_shows_the_board_and_with_them_those_named_so():
    assert board_clips(SETTINGS, experiment(a=None, b=None), "cam1") == ["a", "b"]
    assert board_clips(SETTINGS, experiment("points.csv", board2=None, row1=None), "cam1") == ["board2"]


def test_the_order_of_a_camera_has_the_board_and_nothing_of_the_world():
    order = board_corners(SETTINGS, experiment(a=None), "cam1")
    assert order["clips"]["a"]["board"]["columns"] == 8
    assert "world" not in order["clips"]["a"]["board"]


def test_two_different_boards_are_refused(tmp_path):
    other = tmp_path / "board.yaml"
    other.write_text("type: charuco\ncolumns: 9\nrows: 6\nsquare: 30\n")
    with pytest.raises(VidtrackError, match="different boards"):
        boards(SETTINGS, experiment(a=None, b=str(other)), ["cam1"])
