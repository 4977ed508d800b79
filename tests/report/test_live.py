"""What a browser draws of a run is what its tables hold, to the digits that a page needs."""

import json

import numpy as np
import pandas as pd
import pytest

from vidtrack.report import live

T = np.arange(9) / 30 + 36000.5


def table():
    x = np.sin(T)
    x[4] = np.nan
    rows = pd.DataFrame({"time_s": T, "target": "t1", "x": x, "y": np.cos(T), "z": np.nan})
    return rows.assign(sigma_x=0.0123, sigma_y=0.01, sigma_z=np.nan)


def test_positions_are_those_of_the_table_and_a_lost_sample_is_a_gap():
    data = json.loads(live.positions(table(), "m"))
    assert [panel["label"] for panel in data["panels"]] == ["x (m)", "y (m)"]
    (line,) = data["panels"][0]["lines"]
    assert data["t0"] + np.array(line["t"]) == pytest.approx(T, abs=1e-5)
    assert line["y"][4] is None
    assert [v for v in line["y"] if v is not None] == pytest.approx(np.delete(np.sin(T), 4), rel=1e-5)
    assert line["sd"] == [0.0123] * 9


def test_of_a_long_run_every_so_manieth_sample_is_held(monkeypatch):
    monkeypatch.setattr(live, "MOST", 4)
    data = json.loads(live.positions(table(), "m"))
    assert data["every"] == 3
    assert len(data["panels"][0]["lines"][0]["t"]) == 3


def test_uncertain_ends_are_left_out_of_the_derivatives():
    speeds = {f"{kind}{axis}": np.arange(9.0) for kind in "va" for axis in "xy"}
    flag = ["edge"] * 2 + [""] * 7
    data = json.loads(live.derivatives(table().assign(flag=flag, vz=np.nan, az=np.nan, **speeds), "m"))
    velocity, acceleration = data["panels"]
    assert [line["name"] for line in velocity["lines"]] == ["x", "y"]
    assert velocity["lines"][0]["y"] == [None, None, *range(2, 9)]
    assert acceleration["label"] == "acceleration (m/s²)"


def test_a_comparison_shows_both_records_before_and_after_and_their_difference():
    rows = pd.DataFrame({"time_s": T, "video": 1.0, "reference": 2.0, "reference_aligned": 1.5})
    data = json.loads(live.comparison(rows.assign(difference_aligned=0.5), "m"))
    shown = [[(line["name"], line["y"][0]) for line in panel["lines"]] for panel in data["panels"]]
    assert shown == [
        [("reference", 2.0), ("video", 1.0)],
        [("reference", 1.5), ("video", 1.0)],
        [("reference minus video", 0.5)],
    ]
