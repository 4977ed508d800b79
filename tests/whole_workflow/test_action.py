"""Two action cameras: from the films of docs/wide-lenses.md and docs/rolling-shutter.md to positions."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.whole_workflow.conftest import REPO, configure, snakemake
from vidtrack.files.camera_json import read_camera
from vidtrack.stages.locate import locate
from vidtrack.timing.readout import Readout

CAMERAS = ("cam1", "cam2")
WANTED = ("results/runs/swing/trajectories.parquet", "results/calibration/backprojection.json")


@pytest.fixture(scope="module")
def action(tmp_path_factory):
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    folder = tmp_path_factory.mktemp("action") / "lab"
    set_up(scenario_from(yaml.safe_load((REPO / "data/action.yaml").read_text()), "scenario"), str(folder))
    page = re.search(r"```yaml\n(.*?)```", (REPO / "docs/rolling-shutter.md").read_text(), re.DOTALL)
    config = yaml.safe_load((folder / "config.yaml").read_text())
    for name, camera in yaml.safe_load(page[1])["cameras"].items():
        config["cameras"][name] |= camera
    configure(folder, config)
    answer = snakemake(folder, *WANTED)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def record(folder, name):
    return json.loads((folder / "results" / name).read_text())


def off(folder, table):
    """How far positions are from the truth at their times, mm."""
    truth = pd.read_csv(folder / "runs/swing/truth.csv")
    true = np.stack([np.interp(table["time_s"], truth[truth.columns[0]], truth[a]) for a in "xyz"], -1)
    return table[["x", "y", "z"]].to_numpy(float) - true


def test_wide_lenses_are_found_to_be_equidistant_by_points_left_out(action):
    for name in CAMERAS:
        camera = record(action, f"calibration/{name}/camera.json")
        true = record(action, "../truth/cameras.json")[name]
        assert camera["projection"] == "equidistant"
        assert camera["f"] == pytest.approx(true["f"], rel=2e-3)
        tried = camera["ladder"]["held_out_px"]
        assert tried["equidistant"] < 0.25 * tried["tsai"]
    done = record(action, "calibration/backprojection.json")
    assert done["ratio_with_survey"] < 1.15
    assert done["findings"] == []


def test_read_outs_are_found_from_the_motion_and_positions_are_right_within_their_sigma(action):
    run = record(action, "runs/swing/locate.json")
    for name in CAMERAS:
        found = run["readout_by_motion"][name]
        assert found["seconds"] == pytest.approx(0.025, abs=1e-3)
        assert found["sd"] < 3e-4
    table = pd.read_parquet(action / WANTED[0])
    error = off(action, table)
    assert np.linalg.norm(error, axis=1).mean() < 0.5
    z = error / table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
    assert np.sqrt((z**2).mean()) < 2
    assert run["findings"] == []


def test_without_a_word_of_it_positions_are_late_and_it_is_reported(action):
    tables = {name: pd.read_parquet(action / f"results/runs/swing/centroids/{name}.parquet") for name in CAMERAS}
    calibrated = {name: read_camera(str(action / f"results/calibration/{name}/camera.json")) for name in CAMERAS}
    done = locate(tables, calibrated, readouts=dict.fromkeys(CAMERAS, Readout(0.0, (480, 360))), units="mm")
    assert np.linalg.norm(off(action, done.trajectories), axis=1).mean() > 10  # mm; 0.3 with them
    found = [f["text"][:4] for f in done.record["findings"] if f["code"] == "rolling-shutter"]
    assert found == list(CAMERAS)
