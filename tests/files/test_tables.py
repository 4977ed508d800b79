"""Tables keep units and origin; columns that people left out are filled in, what cannot be is told by line."""

import json
import math

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.tables import (
    read_parquet,
    read_picks,
    read_points,
    read_targets,
    read_units,
    write_csv,
    write_parquet,
)

PROVENANCE = {"vidtrack": "0", "settings": {"Cx": 256.0}, "inputs": {"a.csv": "00"}}


def written(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    return path


def test_points_without_a_tolerance_have_none(tmp_path):
    table = read_points(written(tmp_path, "tag,x,y,z\n1,0,0,5\n"))
    assert list(table.columns[:5]) == ["tag", "x", "y", "z", "sigma"]
    assert math.isnan(table["sigma"][0])


def test_picks_are_those_of_the_camera(tmp_path):
    path = written(tmp_path, "camera,tag,Xf,Yf\ncam1,1,10,20\ncam2,1,30,40\n")
    assert read_picks(path, "cam2")["Xf"].tolist() == [30]
    assert len(read_picks(path)) == 2


def test_boxes_that_start_outside_the_picture_are_told_by_line_those_of_other_cameras_are_their_own(tmp_path):
    path = written(tmp_path, "camera,target,Xf,Yf\ncam1,a,0,479\ncam1,b,512,3\ncam1,c,5,-1\ncam2,a,1900,3\n")
    with pytest.raises(VidtrackError) as caught:
        read_targets(path, "cam1", (512, 480))
    first, second = caught.value.problems
    assert "line 3: target b at (512, 3) is outside the picture of cam1, 512 x 480 px" in first
    assert "line 4: target c" in second
    assert read_targets(path, "cam2", (1920, 1080))["Xf"].tolist() == [1900]


def test_a_box_without_a_size_takes_the_configs(tmp_path):
    table = read_targets(written(tmp_path, "camera,target,Xf,Yf,width\ncam1,a,1,2,30\n"), "cam1", (512, 480))
    assert table["width"][0] == 30
    assert math.isnan(table["height"][0])


def test_a_box_that_starts_below_the_picture_is_told(tmp_path):
    path = written(tmp_path, "camera,target,Xf,Yf\ncam1,a,0,480\n")
    with pytest.raises(VidtrackError, match=r"line 2: target a at \(0, 480\) is outside"):
        read_targets(path, "cam1", (512, 480))


def test_a_column_of_lists_is_read_as_it_was_written(tmp_path):
    table = pd.DataFrame({"time_s": [0.0, 1.0], "covariance": [np.arange(4.0), np.full(4, np.nan)]})
    write_parquet(tmp_path / "t.parquet", table, units="in", provenance={})
    back = read_parquet(tmp_path / "t.parquet")
    assert np.stack(back["covariance"])[0].tolist() == [0, 1, 2, 3]


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


def test_columns_that_are_not_wanted_are_not_read(tmp_path):
    table = pd.DataFrame({"x": [1.0, 2.0], "flag": ["", "edge"], "y": [3.0, 4.0]})
    write_parquet(tmp_path / "t.parquet", table, units="in", provenance=PROVENANCE)
    pd.testing.assert_frame_equal(read_parquet(tmp_path / "t.parquet", {"y", "flag", "z"}), table[["flag", "y"]])


def test_a_missing_value_is_an_empty_cell_in_csv(tmp_path):
    write_csv(tmp_path / "t.csv", pd.DataFrame({"x": [1.5, np.nan]}))
    assert (tmp_path / "t.csv").read_text() == 'x\n1.5\n""\n'


def test_something_else_than_parquet_is_told_by_name(tmp_path):
    path = tmp_path / "t.parquet"
    path.write_text("x,y")
    with pytest.raises(VidtrackError, match="not a Parquet table"):
        read_parquet(path)


@pytest.mark.parametrize(
    ("was", "becomes"), [(b"float64", b"Float64"), (b'"px"', b'"qx"'), (b'"settings"', b'"rettings"')]
)
def test_a_change_of_what_a_table_says_of_its_numbers_is_refused_or_not_read(tmp_path, was, becomes):
    """The file holds each twice, and what reads it needs one of them."""
    path, table = tmp_path / "t.parquet", pd.DataFrame({"Xf": [1.5, 2.0]})
    write_parquet(path, table, units="mm", provenance=PROVENANCE)
    data, refused = path.read_bytes(), 0
    for at in [at for at in range(len(data)) if data.startswith(was, at)]:
        path.write_bytes(data[:at] + becomes + data[at + len(was) :])
        try:
            pd.testing.assert_frame_equal(read_parquet(path), table)
            assert read_units(path) == {"Xf": "px"}
        except VidtrackError:
            refused += 1
    assert refused


def test_a_table_of_an_older_version_says_no_checksum_and_is_read(tmp_path):
    path = tmp_path / "t.parquet"
    write_parquet(path, pd.DataFrame({"Xf": [1.5]}), units="mm", provenance=PROVENANCE)
    arrow = pq.read_table(path)
    said = {name: text for name, text in arrow.schema.metadata.items() if name != b"checksum"}
    pq.write_table(arrow.replace_schema_metadata(said), path)
    assert read_parquet(path)["Xf"].tolist() == [1.5]
    assert read_units(path) == {"Xf": "px"}
