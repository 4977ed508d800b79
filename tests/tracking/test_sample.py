"""A sample's rows and the frame buffer's: a field holds every other row."""

import numpy as np
import pytest

from vidtrack.timing.fields import split
from vidtrack.tracking.sample import Sample


@pytest.mark.parametrize("order", ["top", "bottom"])
def test_a_row_of_a_field_is_the_frame_s_row_that_it_came_from(order):
    frame = np.tile(np.arange(12, dtype=np.uint8)[:, None], (1, 4))
    for field in split(frame, order):
        sample = Sample(field.luma, 0.0, field.parity, 2)
        rows = sample.row(np.arange(field.parity, 12, 2, dtype=float))
        np.testing.assert_array_equal(rows, np.arange(6))
        np.testing.assert_array_equal(field.luma[rows.astype(int), 0], np.arange(field.parity, 12, 2))


def test_a_whole_frame_s_rows_are_its_own():
    y = np.array([0.0, 3.25, 11.0])
    np.testing.assert_array_equal(Sample(np.zeros((12, 4), np.uint8), 0.0).row(y), y)
