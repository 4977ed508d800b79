import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.report.numbers import interval, measured, number, one_over, pick, plain, plain_json, share


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0538447, "0.05384"),
        (240, "240"),
        (1.5e-7, "1.5·10⁻⁷"),
        (None, "–"),
        (math.nan, "–"),
        (True, "True"),
        ("a", "a"),
    ],
)
def test_numbers_keep_their_digits_and_missing_ones_are_dashes(value, text):
    assert number(value) == text


def test_a_share_of_the_field_is_told_as_one_in_so_many():
    assert one_over(0.0538 / 160.5) == "1/2,980"
    assert one_over(1 / 7) == "1/7"
    assert one_over(None) == one_over(0.0) == one_over(math.nan) == "–"


@pytest.mark.parametrize(
    ("value", "sd", "texts"),
    [
        (0.000748792, 0.00024984, ("0.00075", "0.00025")),
        (264.4215, 5.1273, ("264.4", "5.1")),
        (1234.5, 123.0, ("1230", "120")),
        (0.2001, 0.0000996, ("0.20010", "0.00010")),
        (7.49e-8, 2.1e-9, ("7.49·10⁻⁸", "0.21·10⁻⁸")),
        (12.345, None, ("12.35", "–")),
        (12.345, math.nan, ("12.35", "–")),
        (None, 0.1, ("–", "0.1")),
    ],
)
def test_a_number_is_rounded_to_two_figures_of_its_uncertainty(value, sd, texts):
    assert measured(value, sd) == texts


@given(st.floats(-1e6, 1e6), st.floats(1e-5, 1e3))
def test_rounding_moves_no_number_by_more_than_a_twentieth_of_its_uncertainty(value, sd):
    text, spread = measured(value, sd)
    assert abs(float(text) - value) <= 0.0501 * sd
    assert float(spread) == pytest.approx(sd, rel=0.051)


def test_both_ends_of_an_interval_have_two_figures_of_its_width():
    assert interval(0.2, 0.2003) == "0.20000 to 0.20030"
    assert interval(-12.0, 9.5) == "-12 to 10"
    assert interval(0.1, 0.1) == "0.1000 to 0.1000"
    assert interval(None, 0.2) == interval(math.nan, 0.2) == "–"


def test_a_part_of_one_is_told_in_percent():
    assert share(0.9672, 4) == "96.72 %"
    assert share(None) == "–"


def test_a_path_that_ends_early_is_none():
    assert pick({"a": {"b": 3}}, "a", "b") == 3
    assert pick({"a": 5}, "a", "b") is None
    assert pick({}, "a") is None


def test_plain_numbers_keep_their_digits_and_what_is_missing_is_none():
    assert plain([1 / 3, math.nan, 0.0], 3) == [0.333, None, 0.0]


@given(st.lists(st.floats(-1e300, 1e300) | st.just(math.nan), max_size=9), st.sampled_from([3, 6, 9]))
def test_numbers_as_json_are_those_that_json_would_write(values, digits):
    expected = [float(f"{v:.{digits}g}") if math.isfinite(v) else None for v in values]
    assert repr(plain(values, digits)) == repr(expected)
    assert plain_json(values, digits) == json.dumps(expected, separators=(",", ":"))
