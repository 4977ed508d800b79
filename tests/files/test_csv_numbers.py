"""Numbers of a file are read in one way, or refused where two are possible."""

import locale
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.files.csv_numbers import NumberStyle, plain_minus, why_not_a_number

finite = st.floats(allow_nan=False, allow_infinity=False)


@given(st.lists(finite, min_size=1, max_size=5))
def test_what_python_writes_is_read_back_to_the_last_bit(values):
    cells = [repr(value) for value in values]
    style = NumberStyle(cells, ",")
    assert [style.number(cell) for cell in cells] == values
    assert style.ambiguous is None


@given(st.lists(finite.map(lambda x: round(x, 2)).filter(lambda x: abs(x) < 1e6), min_size=1, max_size=5))
def test_decimal_commas_between_semicolons_are_those_values(values):
    cells = [f"{value:.2f}".replace(".", ",") for value in values]
    style = NumberStyle(cells, ";")
    assert style.comma
    assert style.ambiguous is None
    assert [style.number(cell) for cell in cells] == values


@pytest.mark.parametrize(
    ("cells", "separator", "ambiguous"),
    [
        (["1,250"], ",", "1,250"),
        (["1,250"], "\t", "1,250"),
        (["1,250", "0,5"], "\t", None),
        (["27,0159"], "\t", None),
        (["0,125"], "\t", None),
        (["1,250"], ";", None),
        (["1,250", "3"], ";", "1,250"),
        (["1,5", "1.5"], ";", "1,5"),
        (["1.250", "7"], ",", None),
        (["\u22121,250"], "\t", "-1,250"),
    ],
)
def test_a_comma_that_may_mean_thousands_is_named(cells, separator, ambiguous):
    style = NumberStyle(cells, separator)
    assert style.ambiguous == ambiguous
    assert style.is_ambiguous(cells[0]) == (ambiguous is not None)


@pytest.mark.parametrize(
    "cell", ["", "x", "nan", "inf", "1e999", "1,5", "0x10", "1_000", "١٢", "1.2.3", "--1", "1e", "."]
)
def test_what_is_no_finite_number_is_none(cell):
    assert NumberStyle(["1.5"], ",").number(cell) is None


@pytest.mark.parametrize(
    ("cell", "value"), [("\u22121.5", -1.5), ("1e\u22123", 1e-3), (".5", 0.5), ("5.", 5.0), ("+3", 3.0)]
)
def test_a_typesetter_s_minus_is_a_minus(cell, value):
    assert NumberStyle([cell], ",").number(cell) == value
    assert plain_minus("a\u2013b") == "a-b"


@pytest.mark.parametrize(
    ("cell", "read"),
    [
        ("1,25", "1.25"),
        ("10:00:00,5", "10:00:00.5"),
        ("2024-05-06T10:00:00,5Z", "2024-05-06T10:00:00.5Z"),
        ("10:00:00;12", "10:00:00;12"),
        ("\u22121,5", "-1.5"),
        ("10:00:00:12", "10:00:00:12"),
        ("a,b", "a,b"),
    ],
)
def test_a_time_has_a_point_before_its_decimals(cell, read):
    assert NumberStyle(["1,25"], ";").time(cell) == read


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        ("#REF!", "error of the spreadsheet"),
        ("1.234.567,8", "marks between thousands"),
        ("1'234", "marks between thousands"),
        ("12.5 mm", "Write 12.5, and the unit in the header"),
        ("####", "column was too narrow"),
        ("-2' 6.279\"", "in feet and inches. Write it in one unit with decimals"),
        ("5 ft 7 1/2 in", "in feet and inches"),
        ("5′ 7″", "in feet and inches"),
        ("zero", "not a number. Write a number."),
    ],
)
def test_why_a_cell_is_no_number_is_said(cell, says):
    assert says in why_not_a_number(cell)


def test_the_machine_s_locale_changes_no_number(monkeypatch):
    monkeypatch.setattr(locale, "localeconv", lambda: {"decimal_point": ",", "thousands_sep": "."})
    assert NumberStyle(["1.5"], ",").number("1.5") == 1.5
    assert math.isclose(NumberStyle(["1,5"], ";").number("1,5"), 1.5)
