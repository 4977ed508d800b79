"""Sizes of pictures come from the records of calibration and run."""

import json

import pytest

from vidtrack.files.run_inputs import pictures_of, videos_of
from vidtrack.geometry.picture_part import Picture

VIDEO = {"width": 640, "height": 480, "sample_aspect": "1", "rotation": 0}


@pytest.fixture
def paths(tmp_path):
    labelling, reading = tmp_path / "labelling.json", tmp_path / "cam1.json"
    labelling.write_text(json.dumps({"camera": "cam1", "pictures": {"front": {**VIDEO, "width": 1280, "height": 960}}}))
    reading.write_text(json.dumps({"video": VIDEO}))
    return str(labelling), str(reading)


def test_both_pictures_and_the_part_that_the_config_names_are_known(paths):
    own = pictures_of(["cam1"], paths[:1], paths[1:], {}, {"cam1": (0, 0, 640, 480)})["cam1"]
    assert (own.calibration.width, own.run.width) == (1280, 640)
    assert own.crop == (0, 0, 640, 480)


def test_a_camera_of_another_program_has_the_size_that_its_file_states(paths):
    own = pictures_of(["cam1"], [], paths[1:], {"cam1": Picture(800, 600)}, {})
    assert own["cam1"].calibration.width == 800


def test_a_camera_whose_tracks_came_alone_has_no_recording(paths, tmp_path):
    (tmp_path / "cam2.json").write_text("{}")
    assert videos_of(["cam1", "cam2"], [paths[1], str(tmp_path / "cam2.json")]) == {"cam1": VIDEO}
