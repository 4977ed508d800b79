import numpy as np
import pytest

from vidtrack.tracking.state import (
    FLAGS,
    MEASURED,
    MEMORY,
    NEVER,
    PIXELS,
    VALUES,
    Appearance,
    Found,
    Searched,
    Starts,
    TargetState,
)


def starts(n=2, seen=True):
    pair, one = np.full((n, 2), np.nan), np.full(n, 50.0 if seen else np.nan)
    position = np.arange(2.0 * n).reshape(n, 2)
    return Starts(position, pair, pair, np.full((n, 2), 40.0), np.zeros(n, int), one, one, one, pair + 9)


def started(n=2, seen=True):
    of = starts(n, seen)
    return TargetState.before(of).started(np.arange(n), of, 0.0)


def found(who, x, y):
    values = np.full((MEASURED, len(who)), 60.0)
    values[0], values[1] = x, y
    m = len(who)
    return Found(np.array(who), values, np.full((2, m), 9.0), np.full(m, 120.0), np.zeros(m, np.int64))


def test_a_state_never_changes_it_is_followed_by_another():
    state = started()
    before = (state.positions.copy(), state.missing.copy(), state.appearance.values.copy())
    state.found(found([0], 7.0, 8.0))
    state.missed(np.array([0]), 1)
    state.remembering(np.array([1.0]), np.full((1, 2, 2), np.nan), np.zeros((2, 2)))
    state.going(np.array([0]), np.array([[1.0, 1.0]]), 3)
    for now, then in zip((state.positions, state.missing, state.appearance.values), before, strict=True):
        assert np.array_equal(now, then, equal_nan=True)


def test_a_target_whose_looks_are_known_begins_as_measured_and_another_as_sought():
    assert started().missing.tolist() == [0, 0]
    assert started(seen=False).missing.tolist() == [1, 1]


def test_the_box_of_a_target_that_is_seen_for_the_first_time_counts_for_no_sighting():
    now = started(seen=False).found(found([1], 30.0, 40.0))
    assert np.isfinite(now.positions[:, 1, 0]).sum() == 1
    assert now.positions[-1, 1].tolist() == [30, 40]
    assert now.missing.tolist() == [1, 0]
    assert now.appearance.pixels[1] == 60


def test_positions_go_as_samples_come_but_the_last_one_stays():
    state = started(1).found(found([0], 7.0, 8.0))
    nothing = np.full((MEMORY.samples, 1, 2), np.nan)
    later = state.remembering(np.arange(1.0, MEMORY.samples + 1), nothing, np.zeros((1, 2)))
    assert later.positions[0, 0].tolist() == [7, 8]
    assert np.isnan(later.positions[1:]).all()
    assert later.times[-1] == MEMORY.samples


def test_the_last_position_of_a_lost_target_stays_beside_another_that_is_measured():
    state = started(2).found(found([0, 1], np.array([7.0, 17.0]), np.array([8.0, 18.0])))
    fresh = np.full((MEMORY.samples, 2, 2), np.nan)
    fresh[:, 0] = 5.0
    later = state.remembering(np.arange(1.0, MEMORY.samples + 1), fresh, np.zeros((2, 2)))
    assert later.positions[0].tolist() == [[5, 5], [17, 18]]


def test_what_is_taken_to_have_moved_lies_on_a_line_to_where_it_is():
    state = started(1).found(found([0], 7.0, 8.0))
    now = state.going(np.array([0]), np.array([[2.0, -1.0]]), 3)
    assert now.positions[-3:, 0].tolist() == [[3, 10], [5, 9], [7, 8]]


def test_looks_follow_readings_and_first_readings_count_whole():
    rough = Appearance.of_starts(starts(1))
    readings = np.full((VALUES, 2, 1), 100.0)
    first = rough.following(readings, np.ones((2, 1), bool), slice(None))
    assert first.pixels.tolist() == [100]
    readings[PIXELS] = 200
    second = first.following(readings, np.array([[True], [False]]), slice(None))
    assert second.pixels[0] == pytest.approx(120)
    nothing = first.following(readings, np.zeros((2, 1), bool), slice(None))
    assert nothing.pixels[0] == 100


def test_spare_places_have_no_first_sample():
    more = starts().with_spare(3)
    assert more.first.tolist() == [0, 0, NEVER, NEVER, NEVER]
    assert more.box.tolist() == [[40, 40]] * 5
    assert starts().with_spare(0).first.size == 2


def test_a_searched_sample_knows_what_is_measured_of_the_first_targets():
    state = started(3)
    now = Searched(state, np.full((MEASURED, 3), np.nan), np.zeros(3, np.int64))
    now = now.found(found([2], 1.0, 2.0)).missed(np.array([0]), 1)
    assert now.measured(3).T.tolist() == [[1, 2]]
    assert now.measured(2).size == 0
    assert now.flag.tolist() == [1, 0, 0]


def test_each_flag_has_a_word():
    assert len(set(FLAGS)) == 9
