"""Froude's law on textbook numbers."""

import pytest

from vidtrack.analysis.scaling import POWERS, full_scale

LENGTHS = [(0.1, "length", 5.0), (2.0, "per_length", 0.04), (10.0, "angle_per_length", 0.2)]
TIMES = [(1.0, "time", 7.0710678), (1.0, "frequency", 0.14142136), (0.04, "none", 0.04)]


@pytest.mark.parametrize(("value", "quantity", "whole"), [*LENGTHS, *TIMES])
def test_a_model_of_one_to_fifty(value, quantity, whole):
    assert full_scale(value, quantity, 50) == pytest.approx(whole)


def test_a_model_at_full_size_is_itself():
    assert all(full_scale(3.2, quantity, 1.0) == 3.2 for quantity in POWERS)


def test_a_steepness_is_the_same_at_any_size():
    """H / (g T^2) has no unit: Froude's law leaves it alone."""
    assert full_scale(2.0, "length", 37) / full_scale(1.5, "time", 37) ** 2 == pytest.approx(2.0 / 1.5**2)
