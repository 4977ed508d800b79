"""Rows in another unit than the rest are named by what the balls say, and points in one unit are left alone."""

import numpy as np
import pytest

from tests.labelling.test_naming_doubts import POINTS, case
from vidtrack.errors import VidtrackError
from vidtrack.labelling.mixed_units import check_units, larger_rows

PICKS = [0, 3, 16, 19, 27, 35]


@pytest.mark.parametrize("factor", [25.4, 12.0, 1000.0])
def test_rows_in_a_smaller_unit_are_found_by_their_size(factor):
    mixed = np.where(np.arange(36)[:, None] >= 20, factor * (POINTS + 40), POINTS + 40)
    assert any(rows.tolist() == list(range(20, 36)) and k == factor for rows, k in larger_rows(mixed))


def test_points_in_one_unit_leave_nothing_to_divide():
    assert list(larger_rows(POINTS + 40)) == []
    check_units(case(PICKS))


def test_the_tags_and_the_factor_are_named():
    mixed = POINTS.copy()
    mixed[24:] *= 25.4
    with pytest.raises(VidtrackError, match=r"12 of 36 tags \(25, .*divided by 25.4: millimetres among inches\?"):
        check_units(case(PICKS, points=mixed))


def test_without_picks_nothing_is_said_of_units():
    mixed = POINTS.copy()
    mixed[24:] *= 25.4
    check_units(case([0, 3, 16], points=mixed))


@pytest.mark.slow
def test_a_factor_that_the_balls_do_not_confirm_is_not_named():
    mixed = POINTS.copy()
    mixed[24:] = 25.4 * mixed[24:][::-1]
    check_units(case(PICKS, points=mixed))
