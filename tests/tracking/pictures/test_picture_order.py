"""Pictures in another order than they were taken: what the tracks say of it; fields are in `test_track`."""

import numpy as np
import pytest

from vidtrack.tracking.pictures.picture_order import exchanged, order_findings
from vidtrack.tracking.state import MEASURED, POSITION, SD_X, SD_Y, Rows

T = np.arange(60)
SD = 0.03


def course(hz=0.7, rate=30.0, n=2, amplitude=30.0):
    rng = np.random.default_rng(1)
    swing = np.sin(2 * np.pi * hz * T / rate)[:, None] * amplitude * (1 + np.arange(n))
    return np.stack([100 + swing, 80 + 0.3 * swing], -1) + rng.normal(0, SD, (T.size, n, 2))


def moved(where, pairs):
    order = np.arange(len(where))
    order[pairs], order[pairs + 1] = pairs + 1, pairs
    return where[order]


def found(where):
    return exchanged(where, np.full(where.shape, SD))


def test_exchanged_pictures_are_found_where_the_targets_move():
    pairs = np.arange(2, 57, 3)
    out = np.flatnonzero(found(moved(course(), pairs)))
    assert np.isin(out, pairs).all()
    assert len(out) > 0.8 * len(pairs)
    lost = moved(course(), pairs)
    lost[10:20, 0] = np.nan
    assert np.isin(np.flatnonzero(found(lost)), pairs).all()


@pytest.mark.parametrize("hz", [0.0, 0.7, 3.0, 6.0, 9.0, 10.0, 12.0, 14.0])
def test_a_target_that_swings_fast_is_in_order(hz):
    assert not found(course(hz)).any()


def test_a_jump_a_lost_picture_and_repeated_ones_are_no_other_order():
    jump, path = course(), course()
    jump[30:] += 40.0
    for where in (jump, np.delete(path, [20, 21, 40], axis=0), path[np.sort(np.r_[T, 5:50:9])], path[:5]):
        assert not found(where).any()


def test_pictures_out_of_order_are_bad_and_a_few_are_not_named():
    values = np.zeros((MEASURED, T.size, 2))
    values[[SD_X, SD_Y]] = SD
    for pairs, codes in ((np.arange(2, 57, 3), ["pictures-out-of-order"]), (np.array([20]), [])):
        values[POSITION] = moved(course(), pairs).transpose(2, 0, 1)
        rows = Rows(values, np.zeros((T.size, 2, 2)), np.zeros((T.size, 2), np.int64), np.zeros(T.size))
        assert [one.code for one in order_findings(rows, np.full(T.size, "", object), T / 30)] == codes


def test_fields_that_were_taken_at_one_time_are_whole_frames():
    where = np.repeat(course(), 2, axis=0)
    values = np.zeros((MEASURED, len(where), 2))
    values[[SD_X, SD_Y]], values[POSITION] = SD, where.transpose(2, 0, 1)
    rows = Rows(values, np.zeros((*where.shape[:2], 2)), np.zeros(where.shape[:2], np.int64), np.zeros(len(where)))
    (finding,) = order_findings(rows, np.array(["top", "bottom"] * T.size, object), np.arange(2 * T.size) / 60)
    assert "both fields of a frame at one time" in finding.text
    assert finding.cure == "Set detect.fields to frame."


def test_pulldown_is_named_in_place_of_another_order_of_fields():
    where = course()[np.repeat(np.arange(T.size), np.resize([2, 3], T.size))]
    values = np.zeros((MEASURED, len(where), 2))
    values[[SD_X, SD_Y]], values[POSITION] = SD, where.transpose(2, 0, 1)
    rows = Rows(values, np.zeros((*where.shape[:2], 2)), np.zeros(where.shape[:2], np.int64), np.zeros(len(where)))
    (finding,) = order_findings(
        rows, np.resize(np.array(["top", "bottom"], object), len(where)), np.arange(len(where)) / 60
    )
    assert finding.code == "pictures-repeat-in-pattern"
    assert "24 pictures a second were taken and are shown as 60 fields" in finding.text
