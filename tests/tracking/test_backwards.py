"""The opening followed backwards: before a target's own first sample, and of all that was not plain at first."""

import numpy as np
import pytest

from tests.discs import picture
from tests.tracking.test_tracker import DETECTION, circle, samples_of, starts_at
from vidtrack.tracking.backwards import (
    Back,
    Earlier,
    followed_backwards,
    with_earlier,
    with_gaps_filled,
    with_others_filled,
)
from vidtrack.tracking.centroiding.surface import Surfaces
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.outlines.rims import Rims
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import LOST, MERGED, NEVER, PIXELS, RECOVERED, Rows, present
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.windows import Windows

NO_LOOKS = Surfaces(1), Rims(1, DETECTION)


def touching(n):
    """Paths of two targets of radius 4 that overlap at first, and come apart."""
    k = np.arange(n)
    one = np.stack([60 + 3.0 * k, np.full(n, 80.0)], axis=-1)
    return np.stack([one, one + np.stack([np.zeros(n), 6.0 + np.maximum(k - 6, 0) * 1.2], axis=-1)], axis=1)


def begun_late(samples, path, at):
    """A tracker of two targets that nobody has seen before sample `at`, and what it has followed."""
    starts = starts_at(path[0] * np.nan)._replace(first=np.full(2, NEVER))
    tracker = Tracker(starts, DETECTION, 100.0)
    tracker.follow(samples[:at])
    tracker.finish()
    for i in range(2):
        tracker.begin(i, path[at - 3 : at, i], np.arange(at - 3.0, at), [50.0, 180.0, 30.0, 8.0, 8.0])
    return tracker


def test_targets_that_overlap_at_first_are_followed_back_once_they_are_apart():
    path = touching(28)
    samples = samples_of(path)
    tracker = begun_late(samples, path, 20)
    earlier = Earlier(tracker, samples[:20], 48)
    for some in (samples[20:24], samples[24:]):
        tracker.follow(some)
        earlier.add(tracker, some)
    tracker.finish()
    assert not present(tracker.rows())[:20].any()
    whole = earlier.into(tracker, 1)
    assert present(whole).mean() > 0.9
    assert present(whole)[7:].all()
    assert np.nanmax(np.abs(whole.values[:2].transpose(1, 2, 0) - path)) < 0.2
    assert not whole.flag[present(whole)].any()


def half_hidden(path, radius=7.0):
    """Samples of a ball whose lower third a board of the background's level hides."""
    found = []
    for k, (x, y) in enumerate(path[:, 0]):
        luma = picture((160, 160), [(x, y, radius)], level=30.0, contrast=180.0).copy()
        luma[round(y + radius / 3) :] = 30
        found.append(Sample(luma, float(k)))
    return found


@pytest.mark.parametrize("alone", [True, False])
def test_what_rims_show_on_the_way_back_counts_in_the_samples_that_it_fills(alone):
    k = np.arange(30.0)
    path = np.stack([40 + 2.5 * k, 80 + 0 * k], axis=-1)[:, None]
    samples = half_hidden(path)
    begun = starts_at(path[12])._replace(
        first=np.array([12 if alone else NEVER]), velocity=path[13] - path[12], acceleration=np.zeros((1, 2))
    )
    tracker = Tracker(begun, DETECTION, 100.0)
    tracker.follow(samples[:20])
    tracker.finish()
    if not alone:
        seen = path[17:20] - [0, 1.2]
        tracker.begin(0, seen[:, 0], np.arange(17.0, 20), [100.0, 180.0, 30.0, 14.0, 10.0])
    earlier = Earlier(tracker, samples[:20], 48)
    tracker.follow(samples[20:])
    tracker.finish()
    earlier.add(tracker, samples[20:])
    rows = earlier.into(tracker, 1)
    at, n = rows.values[:2], 12 if alone else 20
    assert present(rows)[1:].all()
    assert (np.abs(at[1] - 80) > 1)[1:].all(), "the light that is left lies higher"
    sd = np.full(at.shape, 0.01)
    moved, grown = tracker.looks[1].corrected(at, sd, sd)
    for some in (slice(1, n), slice(n, None)):
        assert np.abs(moved[1, some] - 80).mean() < 0.25
        assert (grown[1, some] > 0.05).mean() > 0.9


def test_samples_are_held_until_all_targets_are_plain_and_no_longer():
    path = touching(28)
    samples = samples_of(path)
    tracker = begun_late(samples, path, 20)
    assert len(Earlier(tracker, samples[:20], 48)._held) == 20
    assert not Earlier(tracker, samples[:20], 20)._held
    plain = Tracker(starts_at(path[10]), DETECTION, 100.0)
    plain.follow(samples[10:20])
    earlier = Earlier(plain, samples[10:20], 48)
    assert not earlier._held
    earlier.add(plain, samples[20:24])
    assert not earlier._held


def rows_of(x, flag=0):
    """Rows of targets at x (samples, n) px, all of 100 pixels; NaN: lost."""
    x = np.array(x, float)
    values = np.full((13, *x.shape), 50.0)
    values[0], values[PIXELS] = x, 100.0
    values[:, np.isnan(x)] = np.nan
    return Rows(values, np.zeros((*x.shape, 2)), np.where(np.isnan(x), LOST, flag), np.zeros(len(x)))


def filled(own, back, flag=0, back_flags=()):
    rows, other = rows_of([[v] for v in own], flag), rows_of([[v] for v in back])
    for s in back_flags:
        other.flag[s] = RECOVERED
    return with_gaps_filled(rows, Back(np.array([0]), 1, other, NO_LOOKS))


def test_gaps_are_filled_as_far_back_as_both_are_of_one_thing():
    no = np.nan
    found = filled([no, 12, no, 16, no, no, 22], [10, 12.1, 14, 15.9, 18, 20, 22])
    assert found.values[0, :, 0].tolist() == [10, 12, 14, 16, 18, 20, 22]
    assert not found.flag.any()
    other = filled([no, 90, no, no, 18, 20, 22], [10, 12, 14, 16, 18, 20, 22])
    assert np.array_equal(other.values[0, :, 0], [no, 90, 14, 16, 18, 20, 22], equal_nan=True)


def test_what_was_measured_before_a_gap_that_is_filled_from_its_end_may_be_another_thing():
    no = np.nan
    found = filled([80, no, no, no, 18, 20], [no, no, 14, 16, 18, 20])
    assert found.flag[:, 0].tolist() == [0, LOST, RECOVERED, 0, 0, 0]
    assert not filled([no, no, no, no, 18, 20], [no, no, 14, 16, 18, 20]).flag[2:].any(), "nothing was before"


def test_where_the_way_back_was_lost_nothing_is_filled_until_both_agree_again():
    no = np.nan
    back = [10, 12, 14, no, no, no, 22, 24]
    found = filled([no, no, no, no, no, no, no, 24], back)
    assert np.array_equal(found.values[0, :, 0], [no, no, no, no, no, no, 22, 24], equal_nan=True)
    found = filled([no, no, no, no, no, no, no, 24], [10, 12, 14, 16, 18, no, 22, 24], back_flags=[4])
    assert np.array_equal(found.values[0, :, 0], [no, no, no, no, no, no, 22, 24], equal_nan=True)
    found = filled([no, 12, no, no, no, no, no, 24], back)
    assert np.array_equal(found.values[0, :, 0], [10, 12, no, no, no, no, 22, 24], equal_nan=True)


def test_other_tracks_are_filled_too_and_stay_in_order_of_time():
    def others(track, sample, x):
        values = np.full((13, len(x)), 50.0)
        values[0] = x
        values[:, np.isnan(x)] = np.nan
        return Others(np.array(track), np.array(sample), values, np.where(np.isnan(x), LOST, 0))

    known = others([7, 8, 8, 8, 8], [2, 2, 3, 4, 5], np.array([90, 14, np.nan, 18, 20.0]))
    back = Back(np.array([1, 8]), 1, rows_of([[0, 10], [0, 12], [0, 14], [0, 16], [0, 18]]), NO_LOOKS)
    found = with_others_filled(known, back)
    assert found.sample.tolist() == [0, 1, 2, 2, 3, 4, 5]
    assert found.track.tolist() == [8, 8, 7, 8, 8, 8, 8]
    assert found.values[0].tolist() == [10, 12, 90, 14, 16, 18, 20]
    assert not found.flag.any()


def test_where_the_way_back_comes_to_what_another_target_shows_neither_is_measured():
    no = np.nan
    rows, back = rows_of([[no, 14], [no, 30], [18, 40]]), rows_of([[14.5], [16], [18]])
    found = with_gaps_filled(rows, Back(np.array([0]), 1, back, NO_LOOKS))
    assert np.isfinite(found.values[0]).tolist() == [[False, False], [True, True], [True, True]]
    assert (found.flag[0] & MERGED > 0).all()


def test_samples_before_a_target_s_own_first_are_followed_backwards():
    path = circle(20, 1, period=40.0)
    samples = samples_of(path)
    begun = starts_at(path[6])
    begun = begun._replace(
        first=np.array([6]), velocity=(path[7] - path[5]) / 2, acceleration=path[7] - 2 * path[6] + path[5]
    )
    target, _, rows, _ = followed_backwards(samples, begun, DETECTION, 100.0, None, Windows(1))
    assert target.tolist() == [0]
    assert rows.flag.shape == (6, 1)
    assert np.abs(rows.values[:2, :, 0].T - path[:6, 0]).max() < 0.1
    never = begun._replace(first=np.array([NEVER]))
    assert followed_backwards(samples, never, DETECTION, 100.0, None, Windows(1)) is None
    assert followed_backwards(samples, starts_at(path[0]), DETECTION, 100.0, None, Windows(1)) is None


@pytest.mark.parametrize("later", [0, 2])
def test_targets_that_touch_until_they_begin_are_followed_backwards_together(later):
    path = touching(20)
    samples = samples_of(path)
    first = np.array([9, 9 + later])  # a blob of one until then
    begun = starts_at(path[first, [0, 1]])._replace(
        first=first,
        velocity=(path[first + 1] - path[first])[[0, 1], [0, 1]],
        acceleration=np.zeros((2, 2)),
        pixels=np.full(2, 50.0),
        contrast=np.full(2, 180.0),
        size=np.full((2, 2), 8.0),
    )
    back = followed_backwards(samples, begun, DETECTION, 100.0, None, Windows(2))
    nothing = np.full((len(back.rows.values), 20, 2), np.nan)
    whole = Rows(nothing, np.zeros((20, 2, 2)), np.full((20, 2), LOST), np.zeros(20))
    whole = with_earlier(whole, back, first)
    assert present(whole)[:9].all()
    assert not present(whole)[9 + later :].any()
    off = np.abs(whole.values[:2].transpose(1, 2, 0) - path)[:9]
    assert off.max() < 0.3
    assert (off < 5 * whole.values[2:4, :9].transpose(1, 2, 0)).all()


def test_two_on_one_way_back_that_it_told_apart_are_both_measured():
    no = np.nan
    rows, back = rows_of([[no, no], [no, no], [18, 30]]), rows_of([[14.5, 17.0], [16, 18.5], [18, 30]])
    found = with_gaps_filled(rows, Back(np.array([0, 1]), 2, back, NO_LOOKS))
    assert np.isfinite(found.values[0]).all()
    whole = with_earlier(
        rows_of([[no, no], [no, no], [18, 30]]), Back(np.array([0, 1]), 2, back, NO_LOOKS), np.full(2, 2)
    )
    assert np.isfinite(whole.values[0]).all()
    assert not (whole.flag & MERGED).any()


def test_what_was_followed_backwards_stands_before_and_is_no_recovery():
    def rows(n, value, flag=0):
        return Rows(np.full((13, n, 2), value), np.full((n, 2, 2), value), np.full((n, 2), flag), np.zeros(n))

    one = Rows(*(a[..., :1] if a.ndim > 1 and i != 1 else a for i, a in enumerate(rows(2, 7.0, RECOVERED))))
    one = one._replace(corner=np.full((2, 1, 2), 7.0))
    whole = rows(5, 1.0)
    joined = with_earlier(whole, Back(np.array([1]), 1, one, NO_LOOKS), np.array([0, 2]))
    assert (joined.values[:, :2, 1] == 7).all()
    assert (joined.values[:, 2:] == 1).all()
    assert (joined.values[..., 0] == 1).all()
    assert (joined.corner[:2, 1] == 7).all()
    assert not (joined.flag & RECOVERED).any()
    assert (whole.values == 1).all()


def test_where_a_target_was_followed_back_onto_another_neither_is_measured():
    def rows(n, x):
        values = np.full((13, n, len(x)), 100.0)
        values[0] = x
        return Rows(values, np.zeros((n, len(x), 2)), np.zeros((n, len(x)), np.int64), np.zeros(n))

    whole = rows(5, [50.0, np.nan, 90.0])
    whole.values[:, :2, 1] = np.nan
    back = rows(2, [50.3])
    back.values[0, 0] = 65.0  # in the sample before it is apart
    joined = with_earlier(whole, Back(np.array([1]), 1, back, NO_LOOKS), np.array([0, 2, 0]))
    measured = np.isfinite(joined.values[0])
    assert measured[:, 0].tolist() == [True, False, True, True, True]
    assert measured[:2, 1].tolist() == [True, False]
    assert measured[:, 2].all()
    assert (joined.flag[1, :2] & MERGED > 0).all()
    assert not joined.flag[[0, 2, 3, 4]].any()
