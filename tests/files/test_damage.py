"""A file of which some bytes changed is read as it was written, or refused in one line: never a traceback."""

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.config_file import read_config
from vidtrack.files.records import read_json, read_png, write_png
from vidtrack.files.tables import read_parquet, read_units, write_parquet
from vidtrack.files.timestack_file import read_timestacks, write_timestacks
from vidtrack.settings.config import settings_from_config
from vidtrack.simulate.rig import thesis_rig

TABLE = pd.DataFrame({"time_s": np.arange(50) / 30, "target": ["a", "b"] * 25, "x": np.linspace(0, 7, 50) ** 3})
CONFIG = "units: in\ncameras:\n  cam1: {Cx: 256, clock: {offset_s: 0.1}}\nruns:\n  p: {targets: [a, b], start: '0'}\n"
fuzzed = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
edits = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), min_size=1, max_size=3)


def spoil(data, changes, length=1.0):
    answer = bytearray(data)
    for where, bits in changes:
        answer[int(where * len(answer))] ^= bits
    return bytes(answer[: max(0, int(length * len(answer)))])


def refused(read, path):
    """What is read, or None where it was refused as it should be."""
    try:
        return read(path)
    except VidtrackError as error:
        (line,) = error.problems
    assert str(path) in line
    assert "\n" not in line
    assert len(line) < 400 + len(str(path))
    return None


@given(edits)
@fuzzed
def test_a_flipped_bit_in_a_table_changes_no_number(tmp_path, changes):
    path = tmp_path / "t.parquet"
    write_parquet(path, TABLE, units="in", provenance={"a": 1})
    path.write_bytes(spoil(path.read_bytes(), changes))
    table = refused(read_parquet, path)
    if table is not None:
        pd.testing.assert_frame_equal(table, TABLE)
    refused(read_units, path)


@given(st.floats(0, 1, exclude_max=True))
@fuzzed
def test_a_table_cut_short_is_refused(tmp_path, length):
    path = tmp_path / "t.parquet"
    write_parquet(path, TABLE, units="in", provenance={})
    path.write_bytes(spoil(path.read_bytes(), [], length))
    assert refused(read_parquet, path) is None


@given(edits, st.floats(0.3, 1))
@fuzzed
def test_a_camera_that_was_spoilt_is_a_camera_or_refused(tmp_path, changes, length):
    path = tmp_path / "camera.json"
    write_camera(path, thesis_rig(1)[0], None, {"model": "tsai"})
    path.write_text(json.dumps(read_json(path), indent=1))  # without its checksum
    path.write_bytes(spoil(path.read_bytes(), changes, length))
    refused(read_camera, path)


@pytest.mark.parametrize(
    "change",
    [
        {"R": [[1, 0], [0, 1]]},
        {"T": [1, 2, None]},
        {"image_size": 3},
        {"image_size": [float("inf"), 2]},
        {"uncertainty": {"names": ["f"], "pivot": [0, 0, 0], "covariance": [[1, 2], [2, 3]]}},
        {"uncertainty": {"names": 3}},
        {"uncertainty": [1]},
    ],
)
def test_a_camera_with_a_value_of_another_shape_is_refused(tmp_path, change):
    path = tmp_path / "camera.json"
    write_camera(path, thesis_rig(1)[0], None, {"model": "tsai"})
    path.write_text(json.dumps(read_json(path) | change))
    assert refused(read_camera, path) is None


@given(edits)
@fuzzed
def test_a_flipped_bit_in_a_record_changes_no_number(tmp_path, changes):
    path = tmp_path / "camera.json"
    write_camera(path, thesis_rig(1)[0], None, {"model": "tsai"})
    wanted = read_json(path)
    path.write_bytes(spoil(path.read_bytes(), changes))
    record = refused(read_json, path)
    assert record is None or {key: record.get(key) for key in wanted} == wanted


@pytest.mark.parametrize("data", [b"\xff{}", b'{"a": ' + b"9" * 5000 + b"}", b"[" * 100_000, b"", b"3"])
def test_a_record_that_is_none_is_refused(tmp_path, data):
    path = tmp_path / "r.json"
    path.write_bytes(data)
    assert refused(read_json, path) is None


@given(edits, st.floats(0, 1))
@fuzzed
def test_timestacks_that_were_spoilt_are_refused_or_as_they_were(tmp_path, changes, length):
    path = tmp_path / "w.npz"
    write_timestacks(path, {"north": {"grey": np.arange(12, dtype=np.uint8).reshape(3, 4)}})
    path.write_bytes(spoil(path.read_bytes(), changes, length))
    refused(read_timestacks, path)


@given(edits, st.floats(0, 1))
@fuzzed
def test_a_picture_that_was_spoilt_is_a_picture_or_refused(tmp_path, changes, length):
    path = tmp_path / "p.png"
    write_png(path, np.arange(64, dtype=np.uint8).reshape(8, 8))
    path.write_bytes(spoil(path.read_bytes(), changes, length))
    refused(read_png, path)


texts = st.text(alphabet="abcunits:in{}[]&*!#'\"- \n\t,0123.|>%@?<=", max_size=80) | st.text(max_size=40)


@pytest.mark.slow
@given(st.integers(0, len(CONFIG)), texts, st.integers(0, 20))
@settings(fuzzed, max_examples=400)
def test_any_config_is_understood_or_refused(tmp_path, at, insert, cut):
    path = tmp_path / "config.yaml"
    path.write_text(CONFIG[:at] + insert + CONFIG[at + cut :])
    config = refused(read_config, str(path))
    problems: tuple[str, ...] = ()
    if config is not None:
        try:
            settings_from_config(config)
        except VidtrackError as error:
            problems = error.problems
    assert all(len(line) < 2000 and "\n" not in line for line in problems)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
            f"{chr(98 + i)}: &{chr(98 + i)} [{','.join([f'*{chr(97 + i)}'] * 9)}]\n" for i in range(8)), "aliases"),
        ("a: &a [*a]\n", "nested too deep"),
        ("a: " + "[" * 5000, "nested too deep"),
        ("a: 2001-99-99\n", "not valid YAML"),
        ("a: !!python/object/apply:os.system [ls]\n", "not valid YAML"),
        ("calibration:\n  clips:\n    c:\n      tags: [01, 02]\n", "put it in quotes: '01'"),
        ("calibration:\n  clips:\n    c:\n      tags: #1, #2\n", "line 4: # begins a comment"),
    ],
)  # fmt: skip
def test_a_config_that_means_something_else_than_it_says_is_refused(tmp_path, text, says):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    with pytest.raises(VidtrackError, match=says):
        read_config(str(path))


def test_a_column_whose_name_was_changed_in_one_place_is_refused(tmp_path):
    """Page checksums guard the values; the names stand in several places of the file's end, and must agree."""
    path = tmp_path / "t.parquet"
    write_parquet(path, TABLE, units="in", provenance={})
    data = path.read_bytes()
    places = [i for i in range(len(data)) if data.startswith(b"time_s", i)]
    assert len(places) > 2
    for place in places:
        path.write_bytes(data[:place] + b"time_z" + data[place + 6 :])
        table = refused(read_parquet, path)
        assert table is None or list(table.columns) == list(TABLE.columns)
