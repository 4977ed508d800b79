"""Files of other programs through the whole workflow: the thesis's, with a calibration made anew and with calb's."""

import numpy as np
import pytest

from tests.exchange.thesis.folder import moving, write_old
from tests.whole_workflow.conftest import snakemake
from vidtrack.command import main
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet


@pytest.fixture(scope="module", params=["points", "old"])
def imported(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(f"imported-{request.param}")
    (folder / "old").mkdir()
    write_old(folder / "old")
    how = ["--units", "in", "--calibration", request.param, "--run", "pluck"]
    assert main(["import", str(folder / "old"), str(folder / "lab"), *how]) == 0
    done = snakemake(folder / "lab")
    assert done.returncode == 0, done.stderr[-3000:]
    return request.param, folder / "lab"


def test_old_tracks_and_calibrations_become_positions_in_space(imported):
    how, lab = imported
    table = read_parquet(lab / "results/runs/pluck/trajectories.parquet")
    error = table[["x", "y", "z"]].to_numpy() - moving()
    assert len(table) == 60
    assert np.sqrt((error**2).mean(0)).max() < 0.03
    sigma = table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
    if how == "points":
        assert 0.6 < np.sqrt((error**2 / sigma**2).mean()) < 1.5
    else:
        assert np.isnan(sigma).all()
    assert table["time_s"].iloc[0] == 36055.0


def test_the_verdict_says_what_is_not_known(imported):
    how, lab = imported
    verdict = read_json(lab / "results/verdict.json")
    codes = {reason["code"] for reason in verdict["calibration"]["reasons"]}
    assert ("camera-sigma-unknown" in codes) is (how == "old")
    assert verdict["verdict"] == ("good" if how == "points" else "doubtful")


def test_nothing_runs_again(imported):
    again = snakemake(imported[1], "-n")
    assert "Nothing to be done" in again.stdout + again.stderr
