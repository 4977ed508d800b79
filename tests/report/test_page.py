import math

import pytest

from vidtrack.report.page import Table, interval, number, one_over, pick, share


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
    assert one_over(0.0538 / 160.5) == "1/2 980"
    assert one_over(1 / 7) == "1/7"
    assert one_over(None) == one_over(0.0) == one_over(math.nan) == "–"


def test_both_ends_of_an_interval_have_two_figures_of_its_width():
    assert interval(0.2, 0.2003) == "0.20000 to 0.20030"
    assert interval(-12.0, 9.5) == "-12 to 10"
    assert interval(0.1, 0.1) == "0.1000 to 0.1000"
    assert interval(None, 0.2) == interval(math.nan, 0.2) == "–"


def test_a_column_holds_words_where_a_cell_begins_with_a_letter():
    rows = [["cam1", "0.2", "tmcd", "–"], ["cam2", "–", "–", "1/24 100"]]
    assert Table("", ["camera", "rms", "time from", "share"], rows).worded == [True, False, True, False]
    assert Table("", ["camera", "rms"], []).worded == [True, True]


def test_a_part_of_one_is_told_in_percent():
    assert share(0.9672, 4) == "96.72 %"
    assert share(None) == "–"


def test_a_path_that_ends_early_is_none():
    assert pick({"a": {"b": 3}}, "a", "b") == 3
    assert pick({"a": 5}, "a", "b") is None
    assert pick({}, "a") is None
