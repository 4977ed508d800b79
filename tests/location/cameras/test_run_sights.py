"""The sights on which trajectories rest, in the picture of the calibration."""

import numpy as np

from vidtrack.geometry.picture_part import Window
from vidtrack.location.cameras.run_sights import RunSights, sight_columns


def test_a_sight_that_was_left_out_is_no_row_and_binned_pictures_are_brought_back():
    b = np.arange(2 * 1 * 3 * 2, dtype=float).reshape(2, 1, 3, 2)
    b[0, 0, 2] = np.nan
    left_out = np.zeros((2, 1, 3), bool)
    left_out[1, 0, 1] = True
    half = Window(0, 0, 640, 480, 320, 240)
    sights = RunSights(np.array([1.0, 2, 3]), ("bow",), ("a", "b"), b, np.full(b.shape, 0.1), left_out, {"b": half})
    rows = sight_columns(sights)
    assert list(zip(rows["camera"], rows["time_s"], strict=True)) == [("a", 1), ("a", 2), ("b", 1), ("b", 3)]
    np.testing.assert_allclose(rows["Xf"][:2], b[0, 0, :2, 0])
    np.testing.assert_allclose(rows["Xf"][2:], half.back(b[1, 0, [0, 2]])[:, 0])
    np.testing.assert_allclose(rows["sd_x"], [0.1, 0.1, 0.2, 0.2])
