"""Atomic files, records and tables: what is written is whole, dated by nothing, and tells its units and origin."""

import json
import os

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing
from vidtrack.files.records import read_json, read_png, write_json, write_png
from vidtrack.files.tables import read_parquet, read_units, write_csv, write_parquet

PROVENANCE = {"vidtrack": "0", "settings": {"Cx": 256.0}, "inputs": {"a.csv": "00"}}


def test_a_file_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path):
    path = tmp_path / "out"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as file:
        file.write(b"half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out"]


def test_folders_are_made_and_permissions_are_those_of_any_new_file(tmp_path):
    with replacing(tmp_path / "a" / "b") as file:
        file.write(b"x")
    (tmp_path / "plain").write_text("x")
    assert (tmp_path / "a" / "b").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_nan_becomes_null_and_arrays_become_lists(tmp_path):
    path = tmp_path / "r.json"
    write_json(path, {"a": np.array([1.5, np.nan]), "b": np.float32(2), "c": {3: np.bool_(True)}}, PROVENANCE)
    assert read_json(path) == {"a": [1.5, None], "b": 2.0, "c": {"3": True}, "provenance": PROVENANCE}


def test_a_record_cut_short_is_told_by_name(tmp_path):
    path = tmp_path / "r.json"
    path.write_text('{"a": [1,')
    with pytest.raises(VidtrackError, match=r"r\.json, line 1: not valid JSON"):
        read_json(path)


def test_every_column_carries_its_unit_and_the_schema_its_origin(tmp_path):
    path = tmp_path / "t.parquet"
    table = pd.DataFrame({"time_s": [0.0], "target": ["t1"], "x": [1.0], "vx": [2.0], "heave": [3.0]})
    write_parquet(path, table, units="in", provenance=PROVENANCE, columns={"heave": "world"})
    assert read_units(path) == {"time_s": "s", "target": "", "x": "in", "vx": "in/s", "heave": "in"}
    schema = pq.read_schema(path)
    assert schema.field("x").metadata[b"unit"] == b"in"
    assert json.loads(schema.metadata[b"provenance"]) == PROVENANCE
    pd.testing.assert_frame_equal(read_parquet(path), table)


def test_the_same_table_makes_the_same_bytes(tmp_path):
    table = pd.DataFrame({"x": np.arange(5.0)})
    for name in "ab":
        write_parquet(tmp_path / name, table, units="m", provenance=PROVENANCE)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_missing_value_is_an_empty_cell_in_csv(tmp_path):
    write_csv(tmp_path / "t.csv", pd.DataFrame({"x": [1.5, np.nan]}))
    assert (tmp_path / "t.csv").read_text() == 'x\n1.5\n""\n'


def test_something_else_than_parquet_is_told_by_name(tmp_path):
    path = tmp_path / "t.parquet"
    path.write_text("x,y")
    with pytest.raises(VidtrackError, match="not a Parquet table"):
        read_parquet(path)


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_a_picture_comes_back_as_it_was(tmp_path, shape, depth):
    picture = np.random.default_rng(0).integers(0, np.iinfo(depth).max, shape).astype(depth)
    write_png(tmp_path / "p.png", picture)
    assert np.array_equal(read_png(tmp_path / "p.png"), picture)
