import pytest
import yaml

from tests.exchange.thesis.folder import write_old
from tests.exchange.thesis.rig import FIXED, points
from vidtrack.arranging.old_files import old_folder, write_experiment
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.camparm import Camparm, write_camparm
from vidtrack.settings.commented import commented_config
from vidtrack.settings.config import settings_from_config


@pytest.fixture
def old(tmp_path):
    folder = tmp_path / "old"
    folder.mkdir()
    write_old(folder)
    return folder


def test_points_and_fixed_numbers_go_where_the_experiment_has_them(old, tmp_path):
    found = old_folder(str(old), "in")
    assert found.config["cameras"]["cam2"]["Cx"] == FIXED.Cx
    assert found.config["cameras"]["cam2"]["tracks"]["size"] == [512, 492]
    assert found.points[0] == ("1", *points(31, 7)[0])
    text = commented_config(found.config)
    write_experiment(found, str(tmp_path / "lab"), text)
    assert settings_from_config(yaml.safe_load(text)).cameras["cam1"].sensor == (8.8, 6.6)


def test_without_a_survey_the_points_of_the_cameras_are_it(old):
    (old / "balls.dat").rename(old / "x")
    found = old_folder(str(old), "in")
    assert len(found.points) == 31
    assert "no balls.dat" in found.notes[0]


def test_an_old_calibration_takes_camera_1s_numbers_for_both_as_calb_did(old):
    other = FIXED._replace(Cx=250.0)
    write_camparm(old / "camparm.dat", Camparm((FIXED, other), (1.0, 1.0)))
    found = old_folder(str(old), "in", calibration="old")
    assert found.config["cameras"]["cam2"]["Cx"] == FIXED.Cx
    assert "calb used those of camera 1" in found.notes[0]
    assert found.points == []
    assert old_folder(str(old), "in").config["cameras"]["cam2"]["Cx"] == 250.0


def test_names_in_capitals_are_known_and_a_missing_file_is_named(old):
    for path in list(old.iterdir()):
        path.rename(old / path.name.upper())
    assert len(old_folder(str(old), "in").copies) == 4
    (old / "OUTCAM2.PRN").unlink()
    with pytest.raises(VidtrackError, match=r"no outcam2\.prn"):
        old_folder(str(old), "in", calibration="old")


def test_nothing_is_overwritten(old, tmp_path):
    found = old_folder(str(old), "in")
    write_experiment(found, str(tmp_path / "lab"), "units: in\n")
    with pytest.raises(VidtrackError, match="is there already"):
        write_experiment(found, str(tmp_path / "lab"), "units: in\n")


@pytest.mark.parametrize(
    ("name", "left", "calibration"),
    [("cam1.prn", 700, "points"), ("cam2vid.prn", 500, "points"), ("outcam1.prn", 200, "old")],
)
def test_a_file_that_was_cut_off_is_refused_before_anything_is_written(old, name, left, calibration):
    text = (old / name).read_bytes()
    assert old_folder(str(old), "in", calibration=calibration)
    (old / name).write_bytes(text[:left])
    with pytest.raises(VidtrackError, match=name.replace(".", r"\.")):
        old_folder(str(old), "in", calibration=calibration)
