"""What a contact sensor's record shows by itself."""

import re

import numpy as np
import pytest

from vidtrack.motion.lag import find_lag
from vidtrack.motion.reference_record import another_size, clock_rate, lag_warnings, scale, without_marks

T = np.arange(0, 20, 1 / 30)
TR = np.arange(-1, 21, 1 / 200)


def motion(t):
    return np.sin(2 * np.pi * 0.7 * t) + 0.3 * np.sin(2 * np.pi * 0.213 * t + 1)


@pytest.mark.parametrize("mark", [-9999.0, 999.0, 1e30])
def test_a_logger_s_mark_for_a_missing_value_is_missing(mark):
    values = motion(TR)
    values[100:150] = mark
    cleaned, warnings = without_marks(values)
    assert np.isnan(cleaned[100:150]).all()
    assert np.array_equal(cleaned[150:], values[150:])
    assert "stands 50 times" in warnings[0]


def test_a_mark_within_the_range_of_the_values_is_a_value():
    values = np.linspace(-2000, 2000, 400)
    values[17] = 999.0
    cleaned, warnings = without_marks(values)
    assert np.isfinite(cleaned).all()
    assert warnings == []


def test_a_value_far_from_all_others_is_named_and_kept():
    values = motion(TR)
    values[77] = 512.5
    cleaned, warnings = without_marks(values)
    assert cleaned[77] == 512.5
    assert "row 78: 512.5" in warnings[0]


@pytest.mark.parametrize(("rate", "level"), [(0.0, None), (1e-4, "note"), (-1e-3, "doubtful"), (1e-2, "doubtful")])
def test_clocks_of_two_rates_are_named_by_how_much(rate, level):
    tr, r = 36000 + TR * (1 + rate), motion(TR) + np.random.default_rng(1).normal(0, 1e-3, len(TR))
    t, video = 36000 + T, motion(T) + np.random.default_rng(2).normal(0, 2e-3, len(T))
    found = clock_rate(tr, r, t, video, find_lag(tr, r, t, video))
    assert (found.level if found else None) == level
    if found:
        off = float(re.search(r"differ by (-?\d+)", found.text)[1])
        assert off == pytest.approx(-1e6 * rate, abs=max(10, 0.002e6 * abs(rate)))
        assert ("29.97" in found.text) == (abs(rate) == 1e-3)


def test_records_of_two_motions_have_no_clock_of_another_rate():
    """A wrong column, which is like the motion for a while at some rate."""
    for seed in range(12):
        walk = np.cumsum(np.random.default_rng(seed).normal(0, 1, len(TR)))
        lag = find_lag(TR, walk, T[:90], motion(T[:90]))
        assert clock_rate(TR, walk, T[:90], motion(T[:90]), lag) is None


@pytest.mark.parametrize(
    ("gain", "sd", "level"),
    [(1.002, 1e-4, None), (0.98, 5e-4, "note"), (0.62, 0.02, "doubtful"), (-0.8, 0.01, "doubtful"), (0.8, 0.1, None)],
)
def test_a_reference_that_moves_by_another_amount_is_said_as_far_as_it_is_known(gain, sd, level):
    found = scale({"gain": gain, "gain_sd": sd})
    assert (found and found.level) == level


def test_another_unit_or_quantity_is_said_elsewhere():
    assert scale({"gain": 25.4, "gain_sd": 0.01}) is None
    assert scale({"gain": float("nan"), "gain_sd": float("nan")}) is None


def test_what_makes_a_lag_less_than_it_seems_says_what_to_do():
    lag = find_lag(TR, motion(TR), T, motion(T))._replace(others=(0.7,), correlation=-0.5)
    for line in lag_warnings(lag, 100):
        assert line.partition(". ")[2], line


def test_a_reference_of_another_size_is_of_another_unit_or_axis():
    assert "one unit of length" in another_size(25.4, "x", "x")
    assert "one unit of length" in another_size(0.1, "y", "x")
    assert "The target moves along x above all" in another_size(4.5, "y", "x")
