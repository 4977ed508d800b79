"""What the job of rule steadiness keeps of a calibration from run to run."""

import os

import numpy as np
import pandas as pd
import pytest

from vidtrack.files.records import write_json, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.jobs.steadiness import _calibrated
from vidtrack.workflow.fingerprint import as_it_is


def files(folder, grey):
    folder.mkdir(exist_ok=True)
    paths = [str(folder / name) for name in ("background.png", "sightings.parquet", "labelling.json")]
    write_png(paths[0], np.full((4, 6), grey, np.uint16))
    ball = {"found": True, "clip": "front", "Xf": 2.0, "Yf": 1.0, "pixels": 9.0}
    write_parquet(paths[1], pd.DataFrame([ball]), units="in", provenance={})
    write_json(paths[2], {"background": {"clip": "front"}, "pictures": {}, "cameras": {}}, {})
    return paths


def kept(paths, clip=None):
    return _calibrated(clip, *map(as_it_is, paths))


def test_a_calibration_is_read_once_and_again_where_a_file_of_it_is_another(tmp_path):
    paths = files(tmp_path / "one", 256)
    found = kept(paths)
    assert kept(paths) is found
    assert kept(paths, "rear") is not found
    with pytest.raises(ValueError, match="read-only"):
        found.picture[0, 0] = 3
    write_png(paths[0], np.full((4, 6), 512, np.uint16))
    assert kept(paths).picture[0, 0] == 2
    assert kept(files(tmp_path / "other", 768)).picture[0, 0] == 3


def test_another_folders_files_of_the_same_names_are_others(tmp_path, monkeypatch):
    shown = {}
    for name, grey in (("one", 256), ("other", 512)):
        paths = files(tmp_path / name, grey)
        monkeypatch.chdir(tmp_path / name)
        shown[name] = kept([os.path.basename(path) for path in paths]).picture[0, 0]
    assert shown == {"one": 1, "other": 2}
