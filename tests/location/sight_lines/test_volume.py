"""A volume is what the points span, and no more."""

import numpy as np
import pytest

from vidtrack.location.sight_lines.volume import distance_outside

CUBE = np.array([[x, y, z] for x in (0, 2) for y in (0, 2) for z in (0, 2)], float)


def test_inside_is_zero_and_outside_is_the_distance_to_the_face():
    p = [[1, 1, 1], [0, 0, 0], [2.5, 1, 1], [1, -3, 1], [np.nan, 0, 0]]
    assert distance_outside(CUBE, p) == pytest.approx([0, 0, 0.5, 3, np.nan], nan_ok=True)


def test_points_in_one_plane_span_no_volume():
    flat = CUBE * [1, 1, 0]
    assert distance_outside(flat, [[1, 1, 0]]) is None
    assert distance_outside(CUBE[:3], [[1, 1, 0]]) is None


def test_lost_calibration_points_do_not_count():
    points = np.concatenate([CUBE, [[np.nan] * 3]])
    assert distance_outside(points, [[2.5, 1, 1]]) == pytest.approx([0.5])
