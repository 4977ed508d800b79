"""The plain values by which the first page knows a run."""

import pandas as pd
import pytest

from vidtrack.report.run_summary import run_summary
from vidtrack.results import RunResults


def test_a_summary_counts_what_was_located_and_joins_the_axes():
    table = pd.DataFrame({"x": [1.0, None, 2.0, 3.0], "sigma_x": 0.003, "sigma_y": 0.004, "sigma_z": [None] * 4})
    table["time_s"], table["target"] = [0.0, 1.0, 2.0, 7.8], "t1"
    compared = {"lag_s": 0.2, "lag_sd_s": 0.1, "after": {"rms": 0.05}, "truth": {"one_over": 21900.0}}
    own = run_summary("pluck", RunResults(tables={"trajectories": table}, records={"comparison": compared}))
    assert (own["samples"], own["located"], own["targets"], own["length_s"]) == (4, 3, 1, 7.8)
    assert own["sigma"] == pytest.approx(0.005)
    assert own["sigma_worst_axis"] == pytest.approx(0.004)
    assert (own["lag_s"], own["lag_sd_s"], own["rms"], own["truth_one_over"]) == (0.2, 0.1, 0.05, 21900.0)


def test_an_edge_of_the_water_counts_where_there_are_no_targets():
    water = pd.DataFrame({"s": [1.0, 2.0], "z": [0.1, None]})
    own = run_summary("beach", RunResults(tables={"waterline": water}))
    assert (own["samples"], own["located"], own["targets"], own["sigma"]) == (2, 1, None, None)
