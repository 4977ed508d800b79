"""Two cameras look through a window into water: from the films of docs/refraction.md to positions in the water."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.whole_workflow.conftest import REPO, configure, snakemake


@pytest.fixture(scope="module")
def tank(tmp_path_factory):
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    values = yaml.safe_load((REPO / "data/tank.yaml").read_text())
    values["runs"]["swing"]["duration_s"] = 1
    folder = tmp_path_factory.mktemp("tank") / "tank"
    set_up(scenario_from(values, "scenario"), str(folder))
    page = re.search(r"```yaml\n(.*?)```", (REPO / "docs/refraction.md").read_text(), re.DOTALL)
    config = yaml.safe_load((folder / "config.yaml").read_text())
    own = yaml.safe_load(page[1])
    config["interfaces"] = own["interfaces"]
    for name, camera in own["cameras"].items():
        config["cameras"][name] |= camera
    configure(folder, config)
    answer = snakemake(folder, "results/verdict.json")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def record(folder, name):
    return json.loads((folder / "results" / name).read_text())


def test_the_calibration_has_the_window_and_says_how_much_it_matters(tank):
    camera = record(tank, "calibration/cam1/camera.json")
    assert camera["through"][0]["name"] == "window"
    assert {"window.position", "window.tilt_1"} <= set(camera["standard_errors"])
    done = record(tank, "calibration/backprojection.json")
    assert [f["code"] for f in done["findings"]].count("refraction-matters") == 1
    assert done["refraction"]["mean_3d_without"] > 1.5 * done["refraction"]["mean_3d"]
    assert 0.4 < done["refraction"]["shift_rms"] < 2
    assert done["ratio_with_survey"] < 1.25


def test_positions_in_the_water_are_right_within_their_sigma(tank):
    found = pd.read_parquet(tank / "results/runs/swing/trajectories.parquet")
    truth = pd.read_csv(tank / "runs/swing/truth.csv")
    time = truth.columns[0]
    true = np.stack([np.interp(found["time_s"], truth[time], truth[a]) for a in "xyz"], -1)
    off = found[["x", "y", "z"]].to_numpy(float) - true
    assert np.isfinite(off).all()
    assert np.linalg.norm(off, axis=1).mean() < 0.5
    z = off / found[[f"sigma_{a}" for a in "xyz"]].to_numpy(float)
    assert np.sqrt((z**2).mean()) < 2
    assert record(tank, "verdict.json")["calibration"]["verdict"] == "good"
