import pytest
import yaml

from vidtrack.errors import VidtrackError
from vidtrack.files.tables import read_picks, read_targets
from vidtrack.picking import store

CONFIG = """# my experiment
units: in      # of every length
cameras: {cam1: , cam2: }
runs:
  pluck:       # the first test
    targets: 2
    # a remark of mine
  12: {}
calibration:
  clips:
    row1:
"""


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(CONFIG)
    return path


def test_detect_keys_are_set_and_every_comment_stays(config):
    store.change_detect(str(config), ("runs", "pluck"), {"threshold": 90, "polarity": "dark"})
    store.change_detect(str(config), ("runs", "12"), {"box": [30, 40]})
    store.change_detect(str(config), ("calibration", "clips", "row1"), {"min_pixels": 9})
    store.change_detect(str(config), (), {"threshold": 70.5})
    text = config.read_text()
    for comment in ("# my experiment", "# of every length", "# the first test", "# a remark of mine"):
        assert comment in text
    read = yaml.safe_load(text)
    assert read["runs"]["pluck"] == {"targets": 2, "detect": {"threshold": 90, "polarity": "dark"}}
    assert read["runs"][12] == {"detect": {"box": [30, 40]}}
    assert read["calibration"]["clips"]["row1"] == {"detect": {"min_pixels": 9}}
    assert read["detect"] == {"threshold": 70.5}


def test_a_key_can_be_taken_away(config):
    store.change_clip(str(config), "row1", {"tags": "1-4"})
    store.change_clip(str(config), "row1", {"tags": None})
    assert not yaml.safe_load(config.read_text())["calibration"]["clips"]["row1"]


@pytest.mark.parametrize("changes", [{"threshold": 300}, {"polarity": "grey"}, {"treshold": 3}])
def test_what_would_be_no_config_is_not_written(config, changes):
    with pytest.raises(VidtrackError):
        store.change_detect(str(config), ("runs", "pluck"), changes)
    assert config.read_text() == CONFIG


def test_picks_and_boxes_are_read_back_by_the_stages_readers(tmp_path):
    picks = [
        {"camera": "cam1", "tag": "1-1", "Xf": 10.25, "Yf": 3.0},
        {"camera": "cam2", "tag": "#7", "Xf": 1.0, "Yf": 2.0},
    ]
    store.write_rows(str(tmp_path / "picks.csv"), store.PICKS, picks)
    assert (tmp_path / "picks.csv").read_text().splitlines()[0] == "camera,tag,Xf,Yf"
    table = read_picks(str(tmp_path / "picks.csv"))
    assert table["tag"].tolist() == ["1-1", "#7"]
    assert table["Xf"].tolist() == [10.25, 1.0]
    store.write_rows(str(tmp_path / "picks.csv"), store.PICKS, [{**picks[0], "sd": 0.5}, picks[1]])
    assert read_picks(str(tmp_path / "picks.csv"))["sd"].tolist()[0] == 0.5
    boxes = [{"camera": "cam1", "target": "a, b", "Xf": 100.0, "Yf": 50.0, "width": 30.0, "height": None}]
    store.write_rows(str(tmp_path / "targets.csv"), store.TARGETS, boxes)
    (row,) = read_targets(str(tmp_path / "targets.csv"), "cam1", (512, 480)).to_dict("records")
    assert (row["target"], row["width"]) == ("a, b", 30)


def test_without_rows_there_is_no_file(tmp_path):
    path = tmp_path / "picks.csv"
    store.write_rows(str(path), store.PICKS, [{"camera": "c", "tag": "1", "Xf": 1.0, "Yf": 1.0}])
    store.write_rows(str(path), store.PICKS, [])
    assert not path.exists()
    assert store.version_of(str(path)) == ""


def test_a_file_that_another_has_changed_is_noticed(tmp_path):
    path = tmp_path / "picks.csv"
    store.check_version(str(path), "")
    path.write_text("a")
    seen = store.version_of(str(path))
    store.check_version(str(path), seen)
    path.write_text("b")
    with pytest.raises(store.Outdated, match="another window"):
        store.check_version(str(path), seen)
