"""Records and pictures come back as they were written, or are refused by name."""

import hashlib
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


def written(tmp_path, record=None):
    path = tmp_path / "r.json"
    write_json(path, {"f": 12.25, "R": [[1.0, 0.5]], "name": "ü"} if record is None else record, PROVENANCE)
    return path


def test_the_last_entry_of_a_record_is_the_sha256_of_the_text_before_it(tmp_path):
    text = written(tmp_path).read_bytes()
    before, _, after = text.rpartition(b'"checksum": "')
    assert after == hashlib.sha256(before + b'"checksum": "').hexdigest().encode() + b'"\n}\n'
    assert list(json.loads(text))[-2:] == ["provenance", "checksum"]


@pytest.mark.parametrize(
    ("was", "becomes"),
    [(b"12.25", b"12.35"), (b'"f"', b'"g"'), (b'"0"', b'"1"'), (b"0.5", b"1e999"), (b'"\xc3\xbc"', b'"\\ud800"')],
)
def test_a_record_that_was_changed_is_refused_with_what_to_do(tmp_path, was, becomes):
    path = written(tmp_path)
    path.write_bytes(path.read_bytes().replace(was, becomes, 1))
    with pytest.raises(
        VidtrackError, match=r"r\.json: was changed.*Delete the file and run again; .*\"checksum\""
    ) as told:
        read_json(path)
    assert len(told.value.problems) == 1


def test_a_change_that_is_meant_is_read_once_the_checksum_is_deleted(tmp_path):
    path = written(tmp_path)
    record = json.loads(path.read_text())
    del record["checksum"]
    path.write_text(json.dumps(record | {"f": 13}))
    assert read_json(path)["f"] == 13


@pytest.mark.parametrize("checksum", [None, 0, "", "0" * 64, ["a"]])
def test_a_checksum_that_is_none_is_a_change(tmp_path, checksum):
    path = tmp_path / "r.json"
    path.write_text(json.dumps({"f": 1, "checksum": checksum}))
    with pytest.raises(VidtrackError, match="was changed"):
        read_json(path)


def test_spaces_and_ends_of_lines_may_change(tmp_path):
    """As an editor, another program or another operating system leaves them."""
    path = written(tmp_path)
    text = path.read_text()
    wanted = read_json(path)
    for other in (text.replace("\n", "\r\n"), json.dumps(json.loads(text)), json.dumps(json.loads(text), indent=4)):
        path.write_text(other)
        assert read_json(path) == wanted


def test_a_record_that_was_read_is_written_with_the_checksum_of_its_own(tmp_path):
    own = json.loads(written(tmp_path).read_text())
    path = written(tmp_path, own | {"f": 2})
    assert read_json(path)["f"] == 2
    assert list(json.loads(path.read_text())) == list(own)


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
