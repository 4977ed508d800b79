"""Calibration balls as points: which rows are balls, and by how much they are moved."""

import numpy as np
import pandas as pd
import pytest

from tests.geometry.underwater import LEFT
from vidtrack.calibration.ball_points import ball_offsets, ball_radii, perspective_record, way_in_the_last_medium
from vidtrack.geometry.ball_perspective import outline_offset
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig


def test_a_ball_is_as_large_as_its_width_says_or_else_its_pixels():
    table = pd.DataFrame({"Xf": 0.0, "pixels": [300, 300, 0, np.nan], "width": [18.0, np.nan, np.nan, np.nan]})
    np.testing.assert_allclose(ball_radii(table), [9.0, np.sqrt(300 / np.pi), np.nan, np.nan])


def test_a_table_without_sizes_has_no_balls():
    assert np.isnan(ball_radii({"Xf": np.zeros(3)})).all()
    assert np.isnan(ball_radii({"Xf": np.zeros(2), "pixels": np.zeros(2)})).all()  # placed by hand


def test_flat_marks_have_no_radius():
    assert np.isnan(
        ball_radii({"Xf": np.zeros(2), "width": [9.0, 8.0], "pixels": [60, 50], "flat": [True, True]})
    ).all()


def test_in_air_the_offsets_are_those_of_the_cone_and_the_record_has_the_largest():
    camera, p = thesis_rig(1)[0], np.array([[3.0, -4.0, 2.0], [-5.0, 5.0, -3.0]])
    b, radius = project(camera, p), np.array([12.0, np.nan])
    offset = ball_offsets(camera, p, b, radius)
    np.testing.assert_array_equal(offset, outline_offset(camera, b, radius))
    record = perspective_record(camera, p, b, offset, radius)
    assert record == {"balls": 1, "largest_px": pytest.approx(float(np.hypot(*offset[0]))), "radius_px": 12.0}
    nothing = perspective_record(camera, p, b, np.zeros((2, 2)), np.full(2, np.nan))
    assert nothing == {"balls": 0, "largest_px": 0.0, "radius_px": None}


def test_through_water_the_way_is_that_from_the_interface():
    p = np.array([[0.0, 0.0, 40.0], [10.0, -5.0, 60.0]])
    b = project(LEFT, p)
    way = way_in_the_last_medium(LEFT, p, b)
    assert (way > 0).all()
    assert (way < np.linalg.norm(p - LEFT.position, axis=-1)).all()
    offset = ball_offsets(LEFT, p, b, np.full(2, 12.0))
    np.testing.assert_array_equal(offset, outline_offset(LEFT, b, 12.0, way))
    assert perspective_record(LEFT, p, b, offset, np.full(2, 12.0))["distance"] == pytest.approx(np.median(way))
