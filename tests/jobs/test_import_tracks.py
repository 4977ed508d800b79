import numpy as np
import pytest

from tests.exchange.tracks.made import dltdv, positions
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.jobs.import_tracks import run
from vidtrack.workflow.job import Job

NAMES = ("centroids", "tracklets", "light", "background")


def job(tmp_path, text, **settings) -> Job:
    (tmp_path / "cam2.csv").write_text(text)
    outputs = {name: str(tmp_path / f"{name}.parquet") for name in NAMES}
    outputs |= {"record": str(tmp_path / "record.json"), "picture": str(tmp_path / "picture.png")}
    order = {"run": "a", "camera": "cam2", "names": None, "sd": None, "tracks": {"camera": "2"}, "rate": 100.0}
    return Job(order | {"start_timecode": None} | settings, {"tracks": str(tmp_path / "cam2.csv")}, outputs)


def test_a_file_of_tracks_becomes_what_a_recording_becomes(tmp_path):
    own = job(tmp_path, dltdv(positions(), letters="UV"))
    run(own)
    table = read_parquet(own.outputs["centroids"])
    np.testing.assert_allclose(table[["Xf", "Yf"]].to_numpy().reshape(-1, 2, 2), positions(), atol=6e-7)
    assert table["time_s"].iloc[-1] == pytest.approx(0.39)
    record = read_json(own.outputs["record"])
    assert record["imported"]["format"] == "dltdv8"
    assert record["video"] is None
    assert record["time"]["source"] == "rows"
    assert record["imported"]["together"]
    assert len(read_parquet(own.outputs["light"])) == 40
    assert len(read_parquet(own.outputs["background"])) == 0


def test_the_rate_is_asked_for_by_its_key(tmp_path):
    with pytest.raises(VidtrackError, match=r"config.yaml: runs\.a\.rate: "):
        run(job(tmp_path, dltdv(positions(), letters="UV"), rate=None))


def test_targets_that_the_config_names_are_taken_in_its_order(tmp_path):
    own = job(tmp_path, dltdv(positions(), letters="UV"), names=["pt2"])
    run(own)
    assert set(read_parquet(own.outputs["centroids"])["target"]) == {"pt2"}
    with pytest.raises(VidtrackError, match="no nose among the tracks; there are pt1, pt2"):
        run(job(tmp_path, dltdv(positions(), letters="UV"), names=["nose"]))


def test_a_time_code_of_the_config_is_used(tmp_path):
    own = job(tmp_path, dltdv(positions(), letters="UV"), rate=30.0, start_timecode="10:00:00:00")
    run(own)
    assert read_parquet(own.outputs["centroids"])["time_s"].iloc[0] == 36000
    with pytest.raises(VidtrackError, match=r"runs\.a\.start_timecode"):
        run(job(tmp_path, dltdv(positions(), letters="UV"), rate=30.0, start_timecode="ten"))
