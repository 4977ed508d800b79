"""The noise of centroids, as their clips show it."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.centroid_noise import SMALLEST_SD_PX, centroid_sd

ALL = np.arange(3)


def test_an_estimate_of_many_frames_counts_and_one_of_few_is_drawn_to_the_usual():
    table = pd.DataFrame({"sd_x": [0.1, 0.1, 0.5], "sd_y": [0.1, 0.1, 0.5], "frames": [1000, 1000, 1]})
    sd = centroid_sd(table, ALL)
    assert abs(sd[0, 0] - np.hypot(0.1, SMALLEST_SD_PX)) < 1e-3
    assert 0.1 < sd[2, 0] < 0.25


def test_a_point_without_an_estimate_has_the_usual_noise():
    table = pd.DataFrame({"sd_x": [0.1, np.nan, 0.1], "sd_y": [0.1, np.nan, 0.1], "frames": 100})
    np.testing.assert_allclose(centroid_sd(table, ALL)[1], np.hypot(0.1, SMALLEST_SD_PX))


def test_where_nothing_is_known_nothing_is_said():
    assert centroid_sd(pd.DataFrame({"Xf": [1.0, 2, 3]}), ALL) is None
    assert centroid_sd(pd.DataFrame({"sd_x": [np.nan] * 3, "sd_y": [np.nan] * 3}), ALL) is None


def test_a_point_placed_by_hand_counts_by_the_sd_that_its_person_gave():
    table = pd.DataFrame({"sd_x": 0.02, "sd_y": 0.02, "frames": 1, "pixels": 40}, index=range(64))
    table.loc[5, ["sd_x", "sd_y"]] = 0.7
    drawn = centroid_sd(table, np.arange(64))[5, 0]
    table.loc[5, "pixels"] = 0
    kept = centroid_sd(table, np.arange(64))
    assert drawn < 0.3  # of a ball's own estimate from a lone frame little is believed
    assert kept[5] == pytest.approx(0.7, abs=0.01)
    assert kept[6] == pytest.approx(0.02, abs=0.01)
