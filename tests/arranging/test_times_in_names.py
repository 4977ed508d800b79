"""Times in the names of recordings."""

import pytest

from vidtrack.arranging.times_in_names import STAMP, one_time_a_take


@pytest.mark.parametrize(
    "name",
    ["20260314101500", "2026-03-14_10-15-00", "20260314T101500", "2026-03-14 10.15.00", "20260314_101500123"],
)
def test_times_are_read_as_cameras_write_them(name):
    assert STAMP.search(f"east_{name}_x").groups() == ("2026", "03", "14", "10", "15", "00")


def test_names_without_a_time_or_with_an_impossible_one_say_nothing():
    assert one_time_a_take({"a": ("", "cam1_20260314101500"), "b": ("", "cam2")}) is None
    assert one_time_a_take({"a": ("", "cam1_20260231101500")}) is None


def test_the_first_recordings_time_names_those_that_began_soon_after():
    stems = {c: ("", f"{c}_2026-03-14_23-59-{s}") for c, s in (("a", 45), ("b", 58))}
    assert one_time_a_take({**stems, "c": ("", "c_2026-03-15_00-00-06")}) == {
        "a": "a__20260314T235945",
        "b": "b__20260314T235945",
        "c": "c__20260315T000006",
    }
