"""The tables of a simulated laboratory: what its people know, and apart from it the truth."""

import csv
import io
import json

import numpy as np
import pytest
import yaml

from tests.simulate.test_laboratory import LAB
from vidtrack.geometry.camera import project
from vidtrack.settings.config import settings_from_config
from vidtrack.simulate.motion import position
from vidtrack.simulate.records import MARK, experiment_config, survey_sigma, surveyed, tables
from vidtrack.simulate.scenario import scenario_from


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    out = {}
    for path, write in tables(scenario_from(LAB)):
        write(str(folder / "file"))
        out[path] = (folder / "file").read_text()
    return out


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_a_scenario_read_back_from_its_mark_is_the_same(written):
    assert scenario_from(yaml.safe_load(written[MARK])) == scenario_from(LAB)


def test_the_config_is_one_that_vidtrack_reads_and_holds_no_truth(written):
    config = yaml.safe_load(written["config.yaml"])
    settings = settings_from_config(config)
    assert set(settings.cameras) == {"left", "right"}
    assert settings.runs["swing"].targets == ("t1",)
    assert settings.calibration.clips["front"].tags == ("1", "2", "3", "4")
    assert "offset_s" not in written["config.yaml"]
    assert config == experiment_config(scenario_from(LAB))


def test_true_cameras_project_as_the_scenario_s(written):
    stored = json.loads(written["truth/cameras.json"])["left"]
    camera = scenario_from(LAB).camera("left")
    assert (stored["f"], stored["Cx"], stored["kappa1"]) == (camera.f, camera.Cx, camera.kappa1)
    np.testing.assert_array_equal(stored["R"], camera.R)
    np.testing.assert_array_equal(stored["T"], camera.T)


def test_the_survey_and_its_truth_differ_by_the_survey_s_error(written):
    scenario = scenario_from(LAB)
    told, true = rows(written["calibration/points.csv"]), rows(written["truth/points.csv"])
    for row, place in zip(told, surveyed(scenario), strict=True):
        np.testing.assert_allclose([float(row[k]) for k in "xyz"], place, atol=1e-5)
        assert float(row["sigma"]) == pytest.approx(survey_sigma(scenario), abs=1e-5)
    for row, place in zip(true, scenario.points()[1], strict=True):
        np.testing.assert_allclose([float(row[k]) for k in "xyz"], place, atol=1e-5)


def test_the_truth_is_where_the_target_was_at_each_label(written):
    """The run's earliest first frame is labelled 01:00:00;00; its cameras begin 0 and 3 frames later."""
    scenario = scenario_from(LAB)
    motion = scenario.runs["swing"].targets["t1"].motion
    rate = float(scenario.recording.rate)
    steps = 1 if scenario.recording.interlace == "none" else 2
    true = rows(written["runs/swing/truth.csv"])
    t = np.array([float(row["time_s"]) for row in true])
    # an hour of drop-frame code is 107892 frames of 1001/30000 s
    np.testing.assert_allclose(t[0], 107892 * 1.001 / 30, atol=1e-8)
    np.testing.assert_allclose(np.diff(t), 1 / (rate * steps), atol=1e-8)
    p = np.array([[float(row[k]) for k in "xyz"] for row in true])
    np.testing.assert_allclose(p, position(motion, (t - t[0])), atol=1e-7)
    assert len(true) >= steps * (0.4 * rate + 3 - 1)


def test_a_start_box_lies_where_its_camera_first_sees_the_target(written):
    scenario = scenario_from(LAB)
    for row in rows(written["runs/swing/targets.csv"]):
        begun = {"left": 0, "right": 3}[row["camera"]] / float(scenario.recording.rate)
        at = project(scenario.camera(row["camera"]), position(scenario.runs["swing"].targets["t1"].motion, begun))
        np.testing.assert_allclose([float(row["Xf"]), float(row["Yf"])], at, atol=0.06)


def test_a_sensor_that_leads_shows_now_what_the_video_shows_later(written):
    scenario = scenario_from(LAB)
    motion = scenario.runs["swing"].targets["t1"].motion
    record = rows(written["runs/swing/reference.csv"])
    t = np.array([float(row["time_s"]) for row in record]) - 107892 * 1.001 / 30
    value = np.array([float(row["x_in"]) for row in record])
    np.testing.assert_allclose(value, position(motion, t + 0.2)[:, 0], atol=3e-3)  # 0.1 ms of 31 in/s
    assert t[0] < 0
    assert t[-1] > 0.4


def test_other_instruments_record_by_the_video_s_clock_from_before_it_to_after_it():
    lab = {**LAB, "runs": {name: dict(run) for name, run in LAB["runs"].items()}}
    name = next(iter(lab["runs"]))
    lab["runs"][name]["channels"] = {"rate": 50, "columns": {"eta": [{"amplitude": 2, "hz": 0.5}]}}
    scenario = scenario_from(lab)
    out = dict(tables(scenario))
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        out[f"runs/{name}/channels.csv"](f"{folder}/file")
        found = rows(Path(folder, "file").read_text())
    t = np.array([float(row["time_s"]) for row in found])
    first = float(scenario.first_code_of(name).clock) - scenario.first_frame_of(name) / float(
        scenario.recording_of(name).rate
    )
    assert t[0] == pytest.approx(first - 0.5)
    eta = np.array([float(row["eta"]) for row in found])
    assert eta == pytest.approx(np.where(t < first, 2.0, 2 * np.cos(np.pi * (t - first))), abs=1e-3)
