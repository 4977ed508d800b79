"""Blocks of samples put together again: the targets, and what else was followed."""

import numpy as np

from vidtrack.tracking.following import record as room
from vidtrack.tracking.following.record import Blocks, Record
from vidtrack.tracking.state import MEASURED, MERGED, PREDICTED, Rows


def block(first, k, places):
    """k samples; every value says which quantity, sample and place it is."""
    sample = first + np.arange(k)
    values = np.arange(MEASURED)[:, None, None] * 10_000.0 + sample[:, None] * 100.0 + np.arange(places)
    corner = np.repeat(values[0][..., None], 2, axis=-1)
    return Rows(values, corner, values[0].astype(np.int64), sample.astype(float))


def filled(*tracks, n=2, k=3):
    record = Record(n)
    for i, track in enumerate(tracks):
        record.append(block(i * k, k, len(track)), i * k + np.arange(float(k)), np.array(track))
    return record


def test_what_was_measured_comes_back_in_order_and_in_its_own_column():
    record = filled([0, 1, 7], [0, 1, 7])
    rows = record.rows()
    assert rows.values.shape == (MEASURED, 6, 2)
    assert np.array_equal(rows.values, block(0, 6, 2).values)
    assert np.array_equal(rows.flag, block(0, 6, 2).flag)
    assert (rows.total_pixels == np.arange(6)).all()
    assert (len(record), record.samples) == (2, 6)


def test_it_does_not_matter_for_how_many_samples_memory_is_taken_at_once(monkeypatch):
    for samples in (1, 2, 4, 5, 100):
        monkeypatch.setattr(room, "BLOCKS", Blocks(samples=samples))
        record = filled([0, 1, 7], [0, 1, 7], [0, 1, -1])
        assert np.array_equal(record.rows().values, block(0, 9, 2).values)
        record.rows().values[0, 4, 1] = np.nan  # what is changed in the rows stays changed
        record.append(block(9, 3, 3), 9 + np.arange(3.0), np.array([0, 1, -1]))
        rows, wanted = record.rows(), block(0, 12, 2)
        wanted.values[0, 4, 1] = np.nan
        for found, right in zip(rows, wanted, strict=True):
            assert np.array_equal(found, right, equal_nan=True)


def test_other_tracks_have_their_own_numbers_and_samples_and_are_none_of_the_targets():
    others = filled([0, 1, -1, -1], [0, 1, -1, 7], [0, 1, 8, 7]).others()
    assert others.track.tolist() == [7] * 3 + [8, 7] * 3
    assert others.sample.tolist() == [3, 4, 5, 6, 6, 7, 7, 8, 8]
    place = np.where(others.track == 7, 3, 2)
    assert np.array_equal(others.values[0], others.sample * 100.0 + place)
    assert np.array_equal(others.values[4] - others.values[0], np.full(9, 40_000.0))
    assert np.array_equal(others.flag, others.sample * 100 + place)


def test_a_track_that_takes_over_a_place_inherits_no_positions():
    times, positions = filled([0, 1, 7], [0, 1, 8]).recent()
    assert times.tolist() == [0, 1, 2, 3, 4, 5]
    assert np.isnan(positions[:3, 2]).all()
    assert np.isfinite(positions[3:, 2]).all()
    assert np.isfinite(positions[:, :2]).all()


def test_an_empty_record_has_rows_of_the_right_shape():
    record = Record(3)
    assert record.rows().values.shape == (MEASURED, 0, 3)
    assert record.rows().flag.shape == (0, 3)
    assert record.recent()[0].size == 0
    assert record.others().values.shape == (MEASURED, 0)


def test_what_was_of_two_is_no_measurement_of_one():
    record = filled([0, 1, 7], [0, 1, 7])
    record.unmeasured(1, np.arange(2, 6))
    record.unmeasured(7, np.array([4, 5]))
    rows, others = record.rows(), record.others()
    assert np.isnan(rows.values[0, :, 1]).tolist() == [False, False, True, True, True, True]
    assert (rows.flag[2:, 1] == MERGED | PREDICTED).all()
    assert np.isfinite(rows.values[:, :, 0]).all()
    assert np.isnan(others.values[0]).tolist() == [False] * 4 + [True] * 2
    samples, values = record.of_track(7)
    assert samples.tolist() == [0, 1, 2, 3, 4, 5]
    assert np.isnan(values[0]).tolist() == [False] * 4 + [True] * 2
    assert record.of_track(1)[1].shape == (MEASURED, 6)
