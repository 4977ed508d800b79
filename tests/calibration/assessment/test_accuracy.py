import numpy as np
import pytest

from vidtrack.calibration.assessment.accuracy import errors_by_axis, largest_distance


def test_the_thesis_table_by_hand():
    error = np.array([[0.1, -0.2, 0.0], [-0.3, 0.2, 0.4], [np.nan, 9, 9]])
    told = errors_by_axis(error, largest_distance=50.0, diagonal_field=160.0)
    assert told["n"] == 2
    assert told["mean_abs"] == pytest.approx({"x": 0.2, "y": 0.2, "z": 0.2})
    assert told["max_abs"] == pytest.approx({"x": 0.3, "y": 0.2, "z": 0.4})
    assert told["mean_abs_percent_of_largest_distance"]["x"] == pytest.approx(0.4)
    assert told["mean_abs_percent_of_diagonal_field"]["x"] == pytest.approx(0.125)
    assert told["mean_3d"] == pytest.approx((np.sqrt(0.05) + np.sqrt(0.29)) / 2)
    assert told["one_over_share_of_diagonal_field"] == pytest.approx(160 / told["mean_3d"])
    assert told["one_over_share_of_diagonal_field_by_axis_mean"] == pytest.approx(800)


def test_the_thesis_own_figure():
    """0.11 in of a 160 in diagonal: the thesis prints 1/1350 and 0.07 %."""
    told = errors_by_axis(np.full((1, 3), 0.1155), largest_distance=60.0, diagonal_field=160.0)
    assert told["one_over_share_of_diagonal_field_by_axis_mean"] == pytest.approx(1385, rel=0.03)
    assert told["mean_abs_percent_of_diagonal_field"]["y"] == pytest.approx(0.072, abs=0.001)


def test_nothing_located_answers_nan():
    told = errors_by_axis(np.full((3, 3), np.nan), largest_distance=1.0, diagonal_field=1.0)
    assert told["n"] == 0
    assert np.isnan(told["mean_3d"])
    assert np.isnan(told["max_abs"]["y"])


def test_largest_distance_of_few_and_of_many_points():
    assert largest_distance(np.array([[0, 0, 0], [3.0, 4, 0], [1, 1, 1], [np.nan] * 3])) == pytest.approx(5)
    assert largest_distance(np.zeros((1, 3))) == 0
    rng = np.random.default_rng(0)
    many = np.vstack([rng.uniform(-1, 1, (2000, 3)), [[5, 5, 5], [-5, -5, -5]]])
    assert largest_distance(many) == pytest.approx(np.sqrt(300))
    flat = np.c_[rng.uniform(-1, 1, (800, 2)), np.zeros(800)]
    assert largest_distance(flat) == pytest.approx(max(np.linalg.norm(flat - q, axis=1).max() for q in flat))
