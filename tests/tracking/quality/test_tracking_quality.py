import numpy as np
import pytest

from vidtrack.tracking.quality.tracking_quality import described, pixel_counts, pixel_locking, shares
from vidtrack.tracking.state import FLAGS, LOST, MERGED, PREDICTED


def test_places_everywhere_in_the_pixel_give_a_flat_histogram():
    flat = pixel_locking(np.random.default_rng(0).uniform(0, 100, 20_000))
    assert flat["excess"] < 1.5 * flat["expected"]
    assert flat["counts"].sum() == 20_000


def test_centroids_that_cling_to_pixels_are_seen():
    locked = pixel_locking(np.round(np.random.default_rng(0).uniform(0, 100, 2000) * 2) / 2)
    assert locked["excess"] > 5 * locked["expected"]


def test_the_middle_of_a_pixel_is_the_middle_of_the_histogram():
    told = pixel_locking(np.array([3.01, 7.02, np.nan]))
    assert told["counts"][np.searchsorted(told["edges"], 0.01) - 1] == 2
    assert told["edges"][[0, -1]] == pytest.approx((-0.5, 0.5))


def test_counts_and_shares_leave_out_what_is_missing():
    counts = pixel_counts(np.array([[50.0, np.nan], [52.0, np.nan], [np.nan, np.nan]]))
    assert [counts[w][0] for w in ("mean", "sd", "min", "max")] == [51, 1, 50, 52]
    assert np.isnan([counts[w][1] for w in counts]).all()
    flag = np.array([[0, LOST | PREDICTED], [0, LOST], [MERGED, 0], [0, 0]])
    assert shares(flag, FLAGS)["lost"].tolist() == [0, 0.5]
    assert described(flag, FLAGS)[0].tolist() == ["", "lost;predicted"]


def test_each_target_has_its_own_least_and_most():
    counts = pixel_counts(np.array([[50.0, 10.0], [52.0, 14.0]]))
    assert counts["min"].tolist() == [50, 10]
    assert counts["max"].tolist() == [52, 14]
