"""Tracklets hold what was measured, in order, and end where a track may have changed over to another target."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vidtrack.association.tracklets import LONGEST_GAP, ends_of_tracks, lanes, may_change, pieces_of, tracklets_of


@given(hnp.arrays(bool, st.tuples(st.integers(1, 3), st.integers(1, 30))), st.integers(0, 29))
def test_tracks_fall_to_pieces_that_keep_every_sample_and_bridge_no_long_gap(there, change):
    b = np.where(there[..., None], 1.0, np.nan) * np.ones(2)
    broken = np.zeros(there.shape, bool)
    broken[:, change % there.shape[1]] = True
    piece = pieces_of(b, broken)
    assert ((piece >= 0) == there).all()
    for k in range(piece.max() + 1):
        track, sample = np.nonzero(piece == k)
        assert len(set(track)) == 1
        assert (np.diff(sample) <= LONGEST_GAP + 1).all()
        assert not sample[0] < change % there.shape[1] <= sample[-1]


def test_a_track_may_change_where_it_was_merged_and_where_it_is_recovered():
    flag = np.array([["", "merged;predicted", "", "lost", "recovered", "recovered", "edge"]], object)
    assert may_change(flag)[0].tolist() == [False, True, False, False, True, False, False]


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 10)), min_size=1, max_size=20))
def test_lanes_hold_tracklets_one_after_another_with_a_moment_between(spans):
    first, length = np.array(spans).T
    last = first + length
    lane = lanes(first, last)
    for k in range(lane.max() + 1):
        own = np.flatnonzero(lane == k)
        own = own[np.argsort(first[own])]
        assert (first[own[1:]] >= last[own[:-1]] + 2).all()
    busy = [((first <= t) & (t <= last + 1)).sum() for t in range(60)]
    assert lane.max() + 1 <= max(busy)


def test_rows_in_any_order_become_tracklets():
    made = tracklets_of([1, -1, 0, 1], np.array([7, 3, 4, 5]), np.arange(8.0).reshape(4, 2), np.ones((4, 2)))
    assert made.n == 2
    assert made.sample.tolist() == [4, 5, 7]
    assert made.b[:, 0].tolist() == [4, 6, 0]
    assert (made.first.tolist(), made.last.tolist()) == ([4, 5], [4, 7])


def test_a_track_ends_as_the_recording_does_or_is_lost_and_begins_likewise():
    b = np.full((100, 3, 2), 5.0)
    b[40:70, 0] = np.nan  # lost in between
    b[:60, 1] = np.nan  # found late
    b[60:, 2] = np.nan  # lost for good
    ends = ends_of_tracks(b)
    assert ends.began.tolist() == ["first", "lost", "found", "first"]
    assert ends.ended.tolist() == ["lost", "last", "last", "lost"]
