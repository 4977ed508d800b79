"""Medians and quantiles over columns: numpy's, to the last digit."""

import numpy as np
import pytest

from vidtrack.tracking.centroiding.order_statistics import median, median_of, middle_and_nearest, quantile, row_medians


@pytest.fixture
def values():
    rng = np.random.default_rng(3)
    values = rng.normal(0, 100, (3, 41, 30))
    values[rng.random(values.shape) < 0.3] = np.nan
    values[0, 1:, 0] = np.nan  # a column of one
    return values


def test_medians_are_those_of_numpy_to_the_last_digit(values):
    np.testing.assert_array_equal(median(values), np.nanmedian(values, axis=1))


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.95, 1.0])
def test_quantiles_are_those_of_numpy_to_the_last_digit(values, share):
    np.testing.assert_array_equal(quantile(values, share), np.nanquantile(values, share, axis=1))


def test_a_column_of_nothing_but_nan_has_neither_median_nor_quantile(values):
    values[1, :, 2] = np.nan
    assert np.isnan(median(values)[1, 2])
    assert np.isnan(quantile(values, 0.25)[1, 2])


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.95, 1.0])
def test_the_nearest_share_is_the_quantile_of_the_distances_from_the_median_to_the_last_digit(values, share):
    values[1, :, 2] = np.nan
    values[2, :20, 3] = 7.0  # ties
    middle, nearest = middle_and_nearest(values, share)
    np.testing.assert_array_equal(middle, median(values))
    np.testing.assert_array_equal(nearest, quantile(np.abs(values - middle[:, None]), share))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("size", [1, 2, 3, 24, 63, 64, 65, 66, 4001, 4002])
def test_the_median_of_all_numbers_is_that_of_numpy_to_the_last_digit(size, kind):
    numbers = np.random.default_rng(size).normal(100, 30, size).astype(kind)
    before = numbers.copy()
    assert median_of(numbers) == np.median(numbers)
    assert (numbers == before).all()
    assert median_of(numbers.reshape(1, -1)) == median_of(numbers)
    numbers[size // 2] = np.nan
    assert np.isnan(median_of(numbers))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("k", [1, 2, 7, 32])
def test_medians_of_rows_are_those_of_numpy_to_the_last_digit(k, kind):
    rows = np.random.default_rng(k).normal(0, 9, (3, 5, k)).astype(kind)
    found = row_medians(rows)
    np.testing.assert_array_equal(found, np.median(rows, axis=-1))
    assert found.dtype == kind
