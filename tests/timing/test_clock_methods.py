"""Which methods estimate which camera's clock."""

from fractions import Fraction

import pytest

from vidtrack.timing.clock import Clock
from vidtrack.timing.clock_methods import METHODS, clocks_to_use, given_clocks, methods_of
from vidtrack.timing.timecode import Timecode


@pytest.mark.parametrize(
    ("clocks", "who"),
    [
        ([{"offset_s": 0.0}, "auto"], [(), ("motion", "sound", "flash")]),
        (["auto", "auto"], [(), ("motion", "sound", "flash")]),
        (["sound", None, "flash"], [("sound",), (), ("flash",)]),
        (["motion", "sound"], [(), ("sound",)]),
        ([], []),
    ],
)
def test_one_clock_is_given_and_the_others_are_estimated_by_the_methods_named(clocks, who):
    assert methods_of(clocks) == who


def test_auto_is_every_method_that_can_be_named():
    assert set(METHODS["auto"]) == set(METHODS) - {"auto"}


def test_a_word_that_is_no_method_is_a_clock_that_is_given():
    assert methods_of(["offset", "sound"]) == [(), ("sound",)]


def test_a_clock_of_which_nothing_is_said_adds_nothing():
    clocks = {"a": {"offset_s": 0.5, "rate_ppm": 20.0}, "b": "sound", "c": {}}
    assert given_clocks("abcd", clocks) == [Clock(0.5, 20.0), "sound", Clock(), Clock()]
    assert given_clocks("ab", None) == [Clock(), Clock()]
    assert given_clocks("ab", "motion") == ["motion", "motion"]


CODE = Timecode(0, Fraction(30))


@pytest.mark.parametrize(
    ("codes", "together", "second"),
    [
        ({"a": None, "b": None}, False, "motion"),
        ({"a": None, "b": None}, True, {}),
        ({"a": None, "b": CODE}, False, {}),
        ({"a": CODE, "b": None}, False, "motion"),
        ({"a": CODE, "b": None}, True, {}),
        ({"a": CODE, "b": CODE}, False, {}),
        ({"a": None}, False, {}),
        ({}, False, {}),
    ],
)
def test_recordings_that_nothing_relates_are_related_by_the_motion(codes, together, second):
    given = {"offset_s": 0.1, "rate_ppm": 0.0}
    assert clocks_to_use({"a": given, "b": None, "c": "sound"}, codes, together) == {
        "a": given,
        "b": second,
        "c": "sound",
    }
