"""The record of a recording: shares, counts and pictures of the worst moments, in plain values."""

import numpy as np

from vidtrack.tracking.crops import Crop
from vidtrack.tracking.quality.track_record import diagnosed, record_scatter
from vidtrack.tracking.state import LOST, MEASURED, PIXELS, PREDICTED, Rows
from vidtrack.tracking.uncertainty.empirical_sd import Scatter


def test_what_was_measured_and_why_not_is_counted():
    values = np.ones((MEASURED, 10, 2))
    values[PIXELS] = 50
    values[:, 4:6, 1] = np.nan
    flag = np.zeros((10, 2), np.int64)
    flag[4:6, 1] = LOST | PREDICTED
    rows = Rows(values, np.zeros((10, 2, 2)), flag, np.full(10, 100.0))
    crop = Crop(4, 1, LOST | PREDICTED, np.zeros((3, 3), np.uint8))
    got = diagnosed(rows, np.arange(10) + 7, np.full(10, "frame", object), ["a", "b"], [crop])
    assert got["samples"] == 10
    assert got["measured"] == 0.9
    assert got["targets"]["b"]["flags"] == {"lost": 0.2, "predicted": 0.2}
    assert got["targets"]["a"]["pixels"]["mean"] == 50
    assert (got["worst"][0]["frame"], got["worst"][0]["target"]) == (11, "b")


def test_a_target_s_sd_says_by_how_much_it_was_grown():
    record = {"targets": {"a": {}}}
    seen = Scatter(*[np.full((2, 1), 1.5)] * len(Scatter._fields))
    record_scatter(record, seen, ["a"])
    assert record["targets"]["a"]["sd_grown"] == {"x": 1.5, "y": 1.5}
    assert "1.50" in record["sd"]
