"""The accuracy of a rig on paper: tables, sweeps, and a check by simulated calibrations."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from vidtrack.calibration.assessment.prediction import Case, Layout
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.errors import VidtrackError
from vidtrack.jobs import sensitivity as job_module
from vidtrack.planning.sensitivity_plan import changed, sensitivity_cases
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.sensitivity import sensitivity

SAMPLE = Path(__file__).parents[2] / "data/sensitivity/thesis.yaml"


def _plan(**more):
    camera = {"tilt_deg": 45, "distance": 160, "field": 128}
    return {
        "cameras": {f"cam{i + 1}": {**camera, "pan_deg": pan} for i, pan in enumerate((-45, 45, 135))},
        "camera_count": 2,
        "calibration": {
            "points": {"spacing": [18, 4, 6]},
            "survey": {"error": 0.03125, "distribution": "uniform"},
        },
        "volume": {"samples": 3},
        "light": {"centroid_px": 0.1},
        **more,
    }


def test_three_lines_in_a_notebook_tell_the_thesis_rig():
    p, sd = thesis_points()[1], np.full(2, 0.1)
    layout = Layout(thesis_rig(), p, p / 2, 1 / 32 / np.sqrt(3), sd, sd, [free_parameters("tsai")] * 2)
    found = sensitivity([Case("", "as planned", layout, diameter=2.0, uniform_survey=True)], trials=8)
    row = found.table.iloc[0]
    assert row["one_over_share_of_diagonal_field"] == pytest.approx(4200, rel=0.03)
    assert row["checked_mean_3d"] == pytest.approx(row["mean_3d"], abs=4 * row["sd_checked_mean_3d"])
    assert row["sd_checked_mean_3d"] < 0.05 * row["mean_3d"]
    for axis in "xyz":
        assert row[f"checked_mean_abs_{axis}"] == pytest.approx(row[f"mean_abs_{axis}"], rel=0.15)
    assert row["target_px"] == pytest.approx(9, rel=0.1)
    assert row["large_enough"]
    assert len(found.volume) == 64
    assert list(found.cameras["camera"]) == ["cam1", "cam2"]
    assert found.cameras["sd_f"].between(0.03, 0.1).all()


def test_a_sweep_varies_one_entry_and_leaves_the_rest():
    plan, cases = sensitivity_cases(
        _plan(sweeps={"light.centroid_px": [0.1, 0.2], "camera_count": [2, 3], "cameras.*.field": [64]})
    )
    assert [(case.sweep, case.value) for case in cases] == [
        ("", "as planned"),
        ("light.centroid_px", 0.1),
        ("light.centroid_px", 0.2),
        ("camera_count", 2),
        ("camera_count", 3),
        ("cameras.*.field", 64),
    ]
    table = sensitivity(cases).table
    assert table["mean_3d"][1] == pytest.approx(table["mean_3d"][0])
    assert 1.7 < table["mean_3d"][2] / table["mean_3d"][0] < 2  # twice the noise, the same survey
    assert 0.6 < table["mean_3d"][4] / table["mean_3d"][3] < 0.85
    assert table["field_width"][5] == pytest.approx(64, rel=0.05)
    assert plan.units == "in"


def test_noise_follows_from_the_target_when_it_is_not_given():
    _, cases = sensitivity_cases(
        _plan(light={}, sweeps={"light.centroid": ["binary"], "light.contrast": [20], "diameter": [0.5]})
    )
    noise = [case.layout.target_sd[0] for case in cases]
    assert noise[0] == pytest.approx(0.021, abs=0.002)
    assert noise[1] > 4 * noise[0]  # whole pixels are coarse
    assert noise[2] > 2 * noise[0]  # a dim ball
    small = sensitivity(cases).table.iloc[3]
    assert not small["large_enough"]  # half an inch in a field 96 in high
    assert small["least_diameter"] == pytest.approx(0.009 * small["field_height"], rel=0.05)


def test_a_rig_that_cannot_be_calibrated_stays_in_the_table_with_its_reason():
    _, cases = sensitivity_cases(_plan(sweeps={"cameras.cam2.target": [[400, 0, 0]]}))
    table = sensitivity(cases).table
    assert "camera 2 sees 0 calibration points" in table["reason"][1]
    assert np.isnan(table["mean_3d"][1])


def test_mistakes_in_a_plan_are_told_by_their_place():
    with pytest.raises(VidtrackError, match=r"light.contrst: no such setting; did you mean 'contrast'"):
        sensitivity_cases(_plan(light={"contrst": 3}))
    with pytest.raises(VidtrackError, match=r"sweeps.light.centroid_px: -1"):
        sensitivity_cases(_plan(sweeps={"light.centroid_px": [-1]}))
    with pytest.raises(VidtrackError, match=r"no camera 'cam9'. There are cam1, cam2, cam3"):
        sensitivity_cases(_plan(sweeps={"cameras.cam9.field": [1]}))
    with pytest.raises(VidtrackError, match="has no parts"):
        sensitivity_cases(_plan(sweeps={"camera_count.x": [1]}))
    with pytest.raises(VidtrackError, match="camera_count is 5; the plan has 3"):
        sensitivity_cases(_plan(camera_count=5))
    with pytest.raises(VidtrackError, match="Swap them"):
        sensitivity_cases(_plan(volume={"low": [1, 1, 1], "high": [0, 0, 0]}))
    with pytest.raises(VidtrackError, match="no parameter 'kapa'"):
        sensitivity_cases(_plan(calibration={"points": {"spacing": [18, 4, 6]}, "fix": ["kapa"]}))


def test_changing_an_entry_leaves_the_plan_as_it_was():
    plan = _plan()
    varied = changed(plan, "cameras.*.field", 90, "here")
    assert {camera["field"] for camera in varied["cameras"].values()} == {90}
    assert {camera["field"] for camera in plan["cameras"].values()} == {128}
    assert changed(plan, "light.noise", 5, "here")["light"] == {"centroid_px": 0.1, "noise": 5}


def test_the_sample_scenario_is_the_thesis_rig_and_the_command_writes_its_tables(tmp_path):
    values = yaml.safe_load(SAMPLE.read_text())
    values["trials"], values["sweeps"] = 2, {"camera_count": [4]}
    scenario = tmp_path / "plan.yaml"
    scenario.write_text(yaml.safe_dump(values))
    assert job_module.main([str(scenario), str(tmp_path / "out")]) == 0
    table = pd.read_csv(tmp_path / "out/table.csv")
    assert table["one_over_share_of_diagonal_field"][0] == pytest.approx(4200, rel=0.03)
    assert table["one_over_share_of_diagonal_field"][1] > 6500
    from vidtrack.files.tables import read_units

    units = read_units(tmp_path / "out/table.parquet")
    assert (units["mean_3d"], units["units_per_px"], units["target_px"]) == ("in", "in/px", "px")
    assert len(pd.read_parquet(tmp_path / "out/volume.parquet")) == 125


def test_every_sweep_of_the_sample_makes_a_rig_that_works():
    _, cases = sensitivity_cases(yaml.safe_load(SAMPLE.read_text()))
    table = sensitivity(cases).table
    assert (table["reason"] == "").all()
    assert (table["share_located"] == 1).all()
    assert (table["ratio"] >= 1).all()


def test_a_scenario_that_is_wrong_ends_in_one_line(tmp_path, capsys):
    scenario = tmp_path / "plan.yaml"
    scenario.write_text("cameras: {}\n")
    assert job_module.main([str(scenario), str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert "plan.yaml: calibration: missing" in said
    assert "Traceback" not in said
    assert not (tmp_path / "out").exists()
