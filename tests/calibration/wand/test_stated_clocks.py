"""Which clocks are stated, and which the wand's motion must give."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.calibration.wand.stated_clocks import stated_times
from vidtrack.timing.timecode import Timecode

T = np.array([10.0, 11.0, 12.0])
CODE = Timecode(250, Fraction(25), False)


def test_a_stated_clock_is_added_and_its_rate_counts_from_the_first_sample():
    done = stated_times({"a": T}, {"a": None}, {"a": {"offset_s": 2.0, "rate_ppm": 500.0}})
    np.testing.assert_allclose(done.times["a"], [12.0, 13.0005, 14.001], atol=1e-12)
    assert done.unknown == []


@pytest.mark.parametrize("word", ["motion", "auto", "sound", "flash"])
def test_a_clock_that_a_method_gives_is_unknown_whatever_the_time_code(word):
    done = stated_times({"a": T, "b": T}, {"a": CODE, "b": CODE}, {"a": None, "b": word})
    assert done.unknown == ["b"]


def test_time_code_states_the_clock_of_cameras_of_which_the_config_says_nothing():
    done = stated_times({"a": T, "b": T}, {"a": CODE, "b": None}, {"a": None, "b": None})
    assert done.unknown == []


def test_without_time_code_all_that_the_config_does_not_state_is_unknown():
    stated = {"offset_s": 0.0, "rate_ppm": 0.0}
    done = stated_times({"a": T, "b": T}, {"a": None, "b": None}, {"a": stated, "b": None})
    assert done.unknown == ["b"]
    np.testing.assert_array_equal(done.times["b"], T)


def test_cameras_on_both_sides_of_midnight_come_on_one_scale():
    late = Timecode(25 * (86400 - 30), Fraction(25), False)
    done = stated_times({"a": T + 86360, "b": T}, {"a": late, "b": CODE}, {"a": None, "b": None})
    assert done.times["b"][0] - done.times["a"][0] == pytest.approx(40.0)
