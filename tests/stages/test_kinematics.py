import numpy as np
import pandas as pd
import pytest

from tests.motion.test_smoothing import pluck
from vidtrack.files.tables import read_parquet, read_units, write_parquet
from vidtrack.jobs import kinematics as job
from vidtrack.stages.kinematics import COLUMNS, jump_findings, kinematics
from vidtrack.workflow.job import Job


def trajectories(noise=0.02, n=300):
    rng, t = np.random.default_rng(1), np.arange(n) / 30
    rows = []
    for target, hz in (("b", 0.9), ("a", 0.5)):
        p = np.stack([pluck(t, hz=hz)[:, 0], 0.1 * t, np.full(n, 2.0)], -1) + rng.normal(0, noise, (n, 3))
        columns = {"time_s": t, "target": target, "x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "flag": ""}
        rows.append(pd.DataFrame({**columns, "sigma_x": noise, "sigma_y": noise, "sigma_z": noise}))
    return pd.concat(rows, ignore_index=True)


def test_each_target_has_its_velocity_and_acceleration():
    table, told = kinematics(trajectories())
    assert list(table) == list(COLUMNS)
    assert list(table["target"].unique()) == ["a", "b"]
    b = table[table["target"] == "b"].iloc[20:-20]
    true = pluck(b["time_s"].to_numpy())
    assert (b["vx"] - true[:, 1]).std() < 0.1
    assert (b["ax"] - true[:, 2]).std() < 1.2
    assert b["vy"].mean() == pytest.approx(0.1, abs=0.01)
    assert all(0.8 < axis["noise_ratio"] < 1.2 for axis in told)


def test_a_missing_sample_stays_missing_and_flags_are_kept():
    given = trajectories()
    given.loc[[100, 101], ["x", "y", "z"]] = np.nan
    given.loc[[100, 101], "flag"] = "lost"
    given.loc[200, "x"] += 1
    given.loc[200, "flag"] = "edge"
    table, _ = kinematics(given)
    b = table[table["target"] == "b"].reset_index(drop=True)
    assert b.loc[[100, 101], ["x", "vx", "ax"]].isna().all(axis=None)
    assert b.loc[[100, 101], "flag"].tolist() == ["lost", "lost"]
    assert b.loc[200, "flag"] == "edge;outlier"
    assert b.loc[0, "flag"] == "edge"


def test_rows_may_come_in_any_order_and_of_two_at_one_moment_the_first_counts():
    given = trajectories(n=60)
    again = given.assign(x=given["x"] + 1).iloc[10:20]
    mixed = pd.concat([given.sample(frac=1, random_state=1), again], ignore_index=True)
    pd.testing.assert_frame_equal(kinematics(mixed)[0], kinematics(given)[0])


def test_a_run_without_a_located_target_gives_an_empty_table():
    assert list(kinematics(trajectories().iloc[:0])[0]) == list(COLUMNS)


def test_the_job_writes_units_into_the_table(tmp_path):
    source, out = str(tmp_path / "t.parquet"), str(tmp_path / "k.parquet")
    write_parquet(source, trajectories(), units="in", provenance={})
    job.run(Job({"units": "in"}, {"trajectories": source}, {"kinematics": out, "record": str(tmp_path / "k.json")}))
    assert read_units(out)["ax"] == "in/s^2"
    assert len(read_parquet(out)) == 600


def test_a_cut_in_all_recordings_is_a_finding_with_its_moment():
    given = trajectories()
    assert jump_findings(given, "in") == []
    late = given["time_s"] >= 5
    given.loc[late, "x"] = given.loc[late, "x"] + 2.0  # both targets are elsewhere from one sample to the next
    (finding,) = jump_findings(given, "in")
    assert (finding.level, finding.code) == ("doubtful", "positions-jump")
    assert "at 5.000 s" in finding.text
    assert "in all cameras alike" in finding.cure
    assert jump_findings(given.assign(flag="lost"), "in") == []
    assert len(jump_findings(given.assign(z=np.nan, sigma_z=np.nan), "in")) == 1  # mode plane
