"""CSV and Parquet of the tables, and the file of their units."""

import io
import json

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from tests.exchange.runs import bodies, run, trajectories
from vidtrack.exchange.plain import units_of, write_csv, write_parquet


def test_csv_gives_every_number_back_to_the_last_digit():
    files = write_csv(run()).files
    back = pd.read_csv(io.BytesIO(files["pluck_trajectories.csv"]))
    own = trajectories()
    for name in ("time_s", "x", "y", "z", "miss"):
        np.testing.assert_array_equal(back[name], own[name])
    assert list(back["target"]) == list(own["target"])


def test_a_missing_number_is_an_empty_cell_and_the_flag_says_why():
    lines = write_csv(run()).files["pluck_trajectories.csv"].decode().splitlines()
    assert lines[6].split(",")[3:6] == ["", "", ""]
    assert "lost;cam1:edge" in lines[6]


def test_the_covariance_of_a_body_is_36_columns():
    back = pd.read_csv(io.BytesIO(write_csv(run()).files["pluck_bodies.csv"]))
    assert back["covariance_3_3"].iloc[0] == bodies()["covariance"].iloc[0][14]


def test_every_column_of_csv_has_a_line_in_the_units():
    files = write_csv(run("cm")).files
    units = json.loads(files["pluck_units.json"])["units"]
    for name in ("pluck_trajectories.csv", "pluck_bodies.csv"):
        assert list(units[name]) == files[name].decode().splitlines()[0].split(",")
    assert units["pluck_trajectories.csv"]["sigma_x"] == "cm"
    assert units["pluck_bodies.csv"]["roll"] == "deg"
    assert units["pluck_trajectories.csv"]["target"] == ""


def test_parquet_has_units_in_its_schema_and_the_same_table():
    files = write_parquet(run()).files
    back = pq.read_table(io.BytesIO(files["pluck_trajectories.parquet"]))
    pd.testing.assert_frame_equal(back.to_pandas(), trajectories(), check_dtype=False)
    assert back.schema.field("x").metadata[b"unit"] == b"in"
    assert json.loads(back.schema.metadata[b"provenance"])["vidtrack"] == "1.2.3"


def test_every_number_of_kinematics_and_motions_has_a_unit():
    table = pd.DataFrame(columns=["vx", "sigma_vz", "az", "sigma_ax", "surge", "sigma_heave", "yaw", "sigma_yaw"])
    assert units_of(table, "m") == {
        "vx": "m/s",
        "sigma_vz": "m/s",
        "az": "m/s^2",
        "sigma_ax": "m/s^2",
        "surge": "m",
        "sigma_heave": "m",
        "yaw": "deg",
        "sigma_yaw": "deg",
    }
