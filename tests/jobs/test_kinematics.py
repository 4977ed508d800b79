"""The smoothing's account stands in a record of its own, where the verdict and the report read it."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.jobs import kinematics
from vidtrack.workflow.job import Job


def test_the_record_says_for_each_target_and_axis_how_the_scatter_compares_with_sigma(tmp_path):
    rng = np.random.default_rng(1)
    t = np.arange(300) / 30
    table = pd.DataFrame({"time_s": t, "target": "t1", "flag": ""})
    for axis in "xyz":
        table[axis] = np.sin(t) + rng.normal(0, 0.04, t.size)
        table[f"sigma_{axis}"] = 0.01
    write_parquet(tmp_path / "trajectories.parquet", table, units="m", provenance={})
    outputs = {"kinematics": str(tmp_path / "kinematics.parquet"), "record": str(tmp_path / "kinematics.json")}
    kinematics.run(Job({"units": "m"}, {"trajectories": str(tmp_path / "trajectories.parquet")}, outputs))
    smoothing = read_json(outputs["record"])["smoothing"]
    assert [(each["target"], each["axis"]) for each in smoothing] == [("t1", "x"), ("t1", "y"), ("t1", "z")]
    assert [each["noise_ratio"] for each in smoothing] == pytest.approx([4.0] * 3, rel=0.15)
    assert len(read_parquet(outputs["kinematics"])) == 300
