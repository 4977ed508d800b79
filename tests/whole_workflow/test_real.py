"""Real recordings, run as their owner would run them; skipped where they are absent."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from tests.whole_workflow.conftest import REPO, snakemake

REAL = REPO.parent / "shared" / "real"
pytestmark = [
    pytest.mark.skipif(not REAL.is_dir(), reason="no real recordings beside the repo"),
]


def run(name, tmp_path_factory):
    folder = tmp_path_factory.mktemp("real") / name
    shutil.copytree(REAL / name, folder)
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755 if path.is_dir() else 0o644)
    answer = snakemake(folder)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


@pytest.fixture(scope="module")
def one_dot(tmp_path_factory):
    return run("one-dot", tmp_path_factory)


@pytest.fixture(scope="module")
def ball_toss(tmp_path_factory):
    return run("ball-toss", tmp_path_factory)


@pytest.mark.parametrize("camera", ["cam1", "cam2", "cam3", "cam4"])
def test_all_dots_are_labelled_and_fit_one_camera(one_dot, camera):
    """Measured by others: kappa1 and a free centre leave 0.76 to 1.8 px."""
    points = pd.read_parquet(one_dot / f"results/calibration/{camera}/points.parquet")
    assert points["found"].sum() == 105
    record = json.loads((one_dot / f"results/calibration/{camera}/camera.json").read_text())
    assert 0.3 < record["rms_px"] < 1.8


def test_dots_are_located_as_well_as_others_did(one_dot):
    """Measured by others: 0.06 to 0.08 mm at the calibration points."""
    record = json.loads((one_dot / "results/calibration/backprojection.json").read_text())
    assert 0.03 < record["mean_3d"] < 0.08


def test_the_ball_is_within_a_pixel_of_the_hand_tracked_one_in_every_frame(ball_toss):
    hand = pd.read_csv(REAL / "ball-toss/hand_tracked.csv")
    table = pd.read_parquet(ball_toss / "results/runs/toss/centroids/cam1.parquet")
    both = hand.merge(table, on="frame", suffixes=("_hand", ""))
    assert len(both) == len(hand)
    apart = np.hypot(both["Xf"] - both["Xf_hand"], both["Yf"] - both["Yf_hand"])
    assert apart.max() < 1.0
    others = table[~table["frame"].isin(hand["frame"])]
    assert others["Xf"].isna().all()  # before the throw there is no ball to be measured
    assert (others["flag"] != "").all()


def test_the_ball_falls_as_balls_fall(ball_toss):
    table = pd.read_parquet(ball_toss / "results/runs/toss/trajectories.parquet").dropna(subset=["y"])
    assert 9.5 < 2 * np.polyfit(table["time_s"], table["y"], 2)[0] < 10.7
