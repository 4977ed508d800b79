"""The page on the wand, its commands as they stand: from rendered films to a trajectory, without any survey."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.whole_workflow.conftest import planned
from tests.whole_workflow.test_tutorial import environment

REPO = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def waved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wand")
    own = environment(folder)
    for block in re.findall(r"^```sh\n(.*?)^```", (REPO / "docs/wand.md").read_text(), re.MULTILINE | re.DOTALL):
        done = subprocess.run(["bash", "-euc", block], cwd=folder, env=own, capture_output=True, text=True, check=False)
        assert done.returncode == 0, block + done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_the_page_on_the_wand_leads_from_films_to_a_trajectory(waved):
    results = waved / "my-lab/results"
    wand = json.loads((results / "calibration/wand.json").read_text())
    assert wand["moments"] > 200
    assert wand["findings"] == []
    assert wand["axes"]["from"] == "up"
    verdict = json.loads((results / "verdict.json").read_text())
    assert verdict["calibration"]["verdict"] == "good"
    assert set(verdict["calibration"]["cameras"]) == {"cam1", "cam2"}
    truth = json.loads((results / "runs/swing/comparison.json").read_text())["truth"]
    assert truth["mean"] < 0.5  # in; picks of the axes are good to 0.3 px, 0.2 in
    assert max(truth["normalised_variance"].values()) < 6  # one draw of the axes
    assert np.isfinite(pd.read_parquet(results / "runs/swing/trajectories.parquet")["sigma_x"]).all()
    page = (results / "report/calibration.html").read_text()
    assert "refined wand" in page
    assert "wand&#39;s length at moments left out" in page or "wand's length at moments left out" in page


@pytest.mark.slow
def test_a_second_call_runs_nothing_and_another_length_follows_no_ball_again(waved):
    folder = waved / "my-lab"
    assert planned(folder) == {}
    config = folder / "config.yaml"
    text = config.read_text()
    config.write_text(text.replace("A-B: 20.0", "A-B: 21.0"))
    jobs = planned(folder)
    config.write_text(text)
    assert jobs["wand"] == 1
    assert "track" not in jobs
    assert "track_wand" not in jobs
