"""Tracks are cut where certainty ends, and only there."""

import numpy as np

from vidtrack.association.tracklets import BEGAN, ENDED
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.following.track_cuts import cut_tracks
from vidtrack.tracking.state import CONTRAST, EDGE, LOST, MEASURED, MERGED, PIXELS, PREDICTED, RECOVERED, Rows

NONE = Others(np.zeros(0, int), np.zeros(0, int), np.zeros((MEASURED, 0)), np.zeros(0, np.int64))


def rows_of(position, missing=()):
    """Rows of tracks (k, n, 2); missing: (target, first, last, flag)."""
    k, n = position.shape[:2]
    values = np.ones((MEASURED, k, n))
    values[:2] = position.transpose(2, 0, 1)
    values[PIXELS], values[CONTRAST] = 50, 100
    flag = np.zeros((k, n), np.int64)
    for i, first, last, why in missing:
        values[:, first : last + 1, i] = np.nan
        flag[first : last + 1, i] = why | PREDICTED
    return Rows(values, np.zeros((k, n, 2)), flag, np.zeros(k))


def line(k=40, n=1, step=2.0):
    return np.stack([10 + step * np.arange(k)[:, None] + 60 * np.arange(n), np.full((k, n), 20.0)], axis=-1)


def cut(rows, others=NONE):
    return cut_tracks(rows, others)


def spans(cut):
    return [(int(s[0]), int(s[-1])) for s in (cut.sample[cut.tracklet == i] for i in range(len(cut.target)))]


def test_a_whole_track_is_one_tracklet():
    got = cut(rows_of(line(n=2)))
    assert spans(got) == [(0, 39), (0, 39)]
    assert got.target.tolist() == [0, 1]
    assert got.began.tolist() == ["first", "first"]
    assert got.ended.tolist() == ["last", "last"]


def test_losses_edges_and_meetings_end_a_tracklet_and_say_so():
    rows = rows_of(line(n=3), [(0, 10, 15, LOST), (1, 10, 15, EDGE), (2, 10, 15, MERGED)])
    got = cut(rows)
    assert spans(got) == [(0, 9), (16, 39)] * 3
    assert got.ended.tolist() == ["lost", "last", "edge", "last", "meeting", "last"]
    assert got.began.tolist() == ["first", "lost", "first", "lost", "first", "meeting"]
    assert {*got.began} <= {*BEGAN}
    assert {*got.ended} <= {*ENDED}


def test_a_sample_or_two_that_are_missing_leave_no_doubt_unless_something_was_there():
    assert spans(cut(rows_of(line(), [(0, 10, 11, LOST)]))) == [(0, 39)]
    assert spans(cut(rows_of(line(), [(0, 10, 10, MERGED)]))) == [(0, 9), (11, 39)]
    again = rows_of(line(), [(0, 10, 10, LOST)])
    again.flag[11, 0] = RECOVERED
    assert spans(cut(again)) == [(0, 9), (11, 39)]


def test_those_that_end_together_have_met():
    both = np.stack([line(step=2.0)[:, 0], line(step=2.0)[:, 0] + [6, 0], line()[:, 0] + [0, 100]], axis=1)
    got = cut(rows_of(both, [(0, 20, 25, MERGED), (1, 21, 25, MERGED), (2, 20, 25, MERGED)]))
    assert got.met[:6].tolist() == ["2", "", "0", "", "", ""]


def test_jumps_and_changes_of_looks_end_a_tracklet_where_they_are():
    jump = line()
    jump[20:, 0, 1] += 30
    got = cut(rows_of(jump))
    assert spans(got) == [(0, 19), (20, 39)]
    assert got.ended.tolist() == ["jump", "last"]
    assert {*got.began} <= {*BEGAN}
    assert {*got.ended} <= {*ENDED}
    looks = rows_of(line())
    looks.values[PIXELS, 25:] = 110
    assert spans(cut(looks)) == [(0, 24), (25, 39)]


def test_a_course_that_bends_sharply_is_no_jump():
    t = np.arange(40)
    bounce = np.stack([10 + 2.0 * t, 20 + 3.0 * np.abs(t - 20)], axis=-1)[:, None]
    assert spans(cut(rows_of(bounce))) == [(0, 39)]


def test_a_sample_that_bends_before_a_jump_is_of_neither_side():
    """Two fall beside each other and bounce at once: each is nearer to where the other was expected."""
    k = np.arange(40.0)
    falls = np.stack([np.full(40, 76.0), 100 + 30 * k], axis=-1)
    rises = np.stack([np.full(40, 67.0), 702 - 30 * (k - 20)], axis=-1)  # the other one, once both have bounced
    swapped = np.where(k[:, None] < 20, falls, rises)[:, None]
    other = np.where(
        k[:, None] < 20, np.stack([rises[:, 0], falls[:, 1] + 40], axis=-1), rises + np.array([9.0, -20.0])
    )[:, None]
    both = np.concatenate([swapped, other], axis=1)
    assert spans(cut(rows_of(both))) == [(0, 19), (20, 20), (21, 39), (0, 19), (20, 39)]
    assert spans(cut(rows_of(swapped))) == [(0, 20), (21, 39)]  # alone it bounced
    sideways = np.where(k[:, None] < 20, falls, falls - (9.0, 0.0))  # as far, and no jump at all
    assert spans(cut(rows_of(sideways[:, None]))) == [(0, 39)]


def others_of(k, track, first, at):
    values = np.ones((MEASURED, k))
    values[:2], values[PIXELS], values[CONTRAST] = at, 50, 100
    return Others(np.full(k, track), first + np.arange(k), values, np.zeros(k, np.int64))


def test_other_tracks_come_after_the_targets_and_are_nobodys():
    got = cut(rows_of(line()), others_of(12, 1, 20, np.array([[100.0], [90.0]])))
    assert spans(got) == [(0, 39), (20, 31)]
    assert got.target.tolist() == [0, -1]
    assert got.began.tolist() == ["first", "found"]


def test_what_is_a_target_s_already_and_what_lasts_two_samples_is_left_out():
    own = line()[20:32, 0].T
    assert spans(cut(rows_of(line()), others_of(12, 1, 20, own))) == [(0, 39)]
    assert spans(cut(rows_of(line()), others_of(2, 1, 20, np.array([[100.0], [90.0]])))) == [(0, 39)]
