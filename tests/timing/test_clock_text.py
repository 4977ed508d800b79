"""Times in words."""

import pytest

from vidtrack.timing.clock_text import of_day, readable


@pytest.mark.parametrize(
    ("seconds", "decimals", "text"),
    [
        (36054.44, 1, "10:00:54.4"),
        (36054.44, 3, "10:00:54.440"),
        (3600.0, 0, "01:00:00"),
        (35999.96, 1, "10:00:00.0"),  # never 09:59:60.0
        (50409.992967, 3, "14:00:09.993"),
        (86399.9996, 3, "00:00:00.000"),
        (0, 3, "00:00:00.000"),
    ],
)
def test_seconds_since_midnight_are_a_time_of_day(seconds, decimals, text):
    assert of_day(seconds, decimals) == text


def test_few_seconds_count_from_a_first_frame():
    assert readable(3.2) == "3.20 s"
    assert readable(36054.44) == "10:00:54.4"
    assert readable(float("nan")) == "nan s"
