import math

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import leading_numbers, lines_of, number, numbers, text_of


@pytest.mark.parametrize(
    ("cell", "value"), [("1.5", 1.5), (" -2 ", -2), ("3,25", 3.25), ("1e-3", 1e-3), ("2.5D+01", 25.0), ("\u22124", -4)]
)
def test_a_number_is_read_as_programs_write_it(cell, value):
    assert number(cell) == value


@pytest.mark.parametrize("cell", ["NaN", "", "-", "-nan(ind)", "1.#QNAN", "None"])
def test_a_missing_value_is_nan(cell):
    assert math.isnan(number(cell))


@pytest.mark.parametrize("cell", ["abc", "1.2.3", "1 2", "12:00"])
def test_what_is_no_number_is_none(cell):
    assert number(cell) is None
    assert numbers(["1", cell]) is None


def test_the_numbers_with_which_a_line_begins_end_at_a_word():
    assert leading_numbers("1 2,5 -3 px 4") == [1, 2.5, -3]
    assert leading_numbers("a 1") == []


@pytest.mark.parametrize(
    "data",
    [b"a\r\nb\x1aleft over", b"a\rb", "a\nb".encode("utf-16"), b"\xef\xbb\xbfa\nb"],
    ids=["DOS", "old Mac", "UTF-16", "byte order mark"],
)
def test_text_of_any_system_is_read(tmp_path, data):
    (tmp_path / "x").write_bytes(data)
    assert lines_of(tmp_path / "x") == ["a", "b"]


@pytest.mark.parametrize(("data", "what"), [(None, "no such file"), (b" \n", "empty"), (b"a\0\0\1", "not a text file")])
def test_what_is_no_text_is_refused_in_one_line(tmp_path, data, what):
    if data is not None:
        (tmp_path / "x").write_bytes(data)
    with pytest.raises(VidtrackError, match=what) as error:
        text_of(tmp_path / "x")
    assert "\n" not in str(error.value)
