"""Headers as people write them: the column is recognised, its unit is read, and neither is guessed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.files.csv_header import LENGTHS, TIMES, UNITS, column_of, split_unit

NAMES = ["tag", "x", "y", "time_s", "Xf"]


@pytest.mark.parametrize("form", ["{} ({})", "{} [{}]", "{}({})", "{}_{}", "{} / {}", "{}, {}", "{}: {}", "{} <{}>"])
@pytest.mark.parametrize("word", [word for words in UNITS.values() for word in words if word not in ('"', "'")])
def test_every_unit_is_read_beside_a_name_in_every_form(form, word):
    unit = next(unit for unit, words in UNITS.items() if word in words)
    if word.endswith(".") and form in ("{}, {}", "{}_{}", "{} / {}", "{}: {}"):
        word = word.rstrip(".")
    assert column_of(form.format("x", word), NAMES) == ("x", unit)
    assert column_of(form.format("X", word.upper()), NAMES)[1] in (unit, "")


@pytest.mark.parametrize(
    ("cell", "name", "unit"),
    [
        ("x", "x", ""),
        ("XF", "Xf", ""),
        ("time_s", "time_s", ""),
        ("TIME_S", "time_s", ""),
        ("time (s)", "time_s", "s"),
        ("Time [ms]", "time_s", "ms"),
        ('x (")', "x", "in"),
        ("x (')", "x", "ft"),
        ("x (mm) ", None, ""),
        ("x (lightyears)", None, ""),
        ("distance (mm)", None, "mm"),
        ("(mm)", None, ""),
        ("", None, ""),
        ("xmm", None, ""),
    ],
)
def test_a_column_is_recognised_or_it_is_none(cell, name, unit):
    assert column_of(cell, NAMES) == (name, unit)


def test_an_exact_name_comes_before_one_in_other_capitals():
    assert column_of("X", ["x", "X"]) == ("X", "")
    assert column_of("X", ["X", "x"]) == ("X", "")


def test_milli_and_mega_are_not_confused_by_capitals():
    """A unit in its own capitals is itself; in others it is the small one, as no header means megametres."""
    assert split_unit("x (m)")[1] == "m"
    assert split_unit("x (M)")[1] == "m"
    assert split_unit("x (MM)")[1] == "mm"


@given(st.text())
def test_any_cell_is_split_into_itself_or_a_shorter_base_and_a_known_unit(cell):
    base, unit = split_unit(cell)
    assert (base == cell and not unit) or (unit in UNITS and len(base) < len(cell) and cell.startswith(base))


def test_units_of_length_and_time_are_known_and_different():
    assert LENGTHS | TIMES <= set(UNITS)
    assert not LENGTHS & TIMES
