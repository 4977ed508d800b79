"""Records and pictures come back as they were written, or are refused by name."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.files.records import plain, read_json, read_png, write_json, write_png

PROVENANCE = {"vidtrack": "0", "settings": {"Cx": 256.0}, "inputs": {"a.csv": "00"}}


def test_nan_becomes_null_and_arrays_become_lists(tmp_path):
    path = tmp_path / "r.json"
    write_json(path, {"a": np.array([1.5, np.nan]), "b": np.float32(2), "c": {3: np.bool_(True)}}, PROVENANCE)
    assert read_json(path) == {"a": [1.5, None], "b": 2.0, "c": {"3": True}, "provenance": PROVENANCE}


def test_a_record_cut_short_is_told_by_name(tmp_path):
    path = tmp_path / "r.json"
    path.write_text('{"a": [1,')
    with pytest.raises(VidtrackError, match=r"r\.json, line 1: not valid JSON"):
        read_json(path)


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_a_picture_comes_back_as_it_was(tmp_path, shape, depth):
    picture = np.random.default_rng(0).integers(0, np.iinfo(depth).max, shape).astype(depth)
    write_png(tmp_path / "p.png", picture)
    assert np.array_equal(read_png(tmp_path / "p.png"), picture)


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.text(), values, max_size=4))
def test_plain_values_are_json_and_plain_again(record):
    once = plain(record)
    assert plain(once) == once
    assert json.loads(json.dumps(once, allow_nan=False)) == once


def test_a_key_is_text_and_a_thing_without_a_form_of_its_own_its_name(tmp_path):
    assert plain({1: (np.int64(3), np.inf, tmp_path)}) == {"1": [3, None, str(tmp_path)]}
    assert plain(True) is True


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"[1, 2]", "holds no record"),
        (b"\xff\xfe{}", "not valid JSON"),
        (b'{"a": ' + b"9" * 5000 + b"}", "not valid JSON"),
        (b"[" * 100_000, "not valid JSON"),
    ],
)
def test_what_is_no_record_is_refused_by_name(tmp_path, data, says):
    (tmp_path / "r.json").write_bytes(data)
    with pytest.raises(VidtrackError, match=rf"r\.json.*{says}.*Delete the file and run again"):
        read_json(tmp_path / "r.json")


@pytest.mark.parametrize("data", [b"", b"no picture", b"\x89PNG\r\n\x1a\n1234"])
def test_what_is_no_picture_is_refused_by_name(tmp_path, data):
    (tmp_path / "p.png").write_bytes(data)
    with pytest.raises(VidtrackError, match=r"p\.png: not a picture"):
        read_png(tmp_path / "p.png")


def test_a_picture_that_png_cannot_hold_is_the_callers_mistake(tmp_path):
    with pytest.raises(ValueError, match="cannot be a PNG"):
        write_png(tmp_path / "p.png", np.zeros((0, 4), np.uint8))
