import math

import pytest

from vidtrack.telling.page import number, one_over, pick, share


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


def test_a_part_of_one_is_told_in_percent():
    assert share(0.9672, 4) == "96.72 %"
    assert share(None) == "–"


def test_a_path_that_ends_early_is_none():
    assert pick({"a": {"b": 3}}, "a", "b") == 3
    assert pick({"a": 5}, "a", "b") is None
    assert pick({}, "a") is None
