"""Picks become seeds: at the blobs near them, one to one, with some left out, moved or exchanged."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.labelling.label import SD_START, Picks, View
from vidtrack.labelling.seeds import _as_they_are, _changed, _in_agreement, _snapped, label_from_picks, on_one_line
from vidtrack.simulate.rig import thesis_points, thesis_rig

POINTS = thesis_points()[1]
CAMERA = thesis_rig()[0]
ROW = np.arange(16)


def clip(rng=None):
    b = project(CAMERA, POINTS[ROW])
    if rng is not None:
        b = b + rng.normal(0, 0.1, b.shape)
    return b, View(ROW, b, np.full((16, 2), 4.0))


def picks_at(b, which, shift=(3.0, -2.0)):
    return Picks(np.zeros(len(which), int), np.array(which), b[which] + np.array(shift))


def test_a_pick_takes_the_blob_nearest_to_it():
    b, view = clip()
    seeds = _snapped(picks_at(b, [0, 5, 10]), [0, 1, 2], [view], 30.0)
    np.testing.assert_array_equal(seeds.chosen, [0, 5, 10])
    np.testing.assert_array_equal(seeds.xy, b[[0, 5, 10]])
    assert (seeds.sd == SD_START).all()


def test_a_pick_with_no_blob_in_reach_stays_and_is_trusted_less():
    b, view = clip()
    seeds = _snapped(picks_at(b, [0, 5], shift=(3.0, 0.0)), [0, 1], [view], 2.0)
    np.testing.assert_array_equal(seeds.chosen, [-1, -1])
    np.testing.assert_array_equal(seeds.xy, b[[0, 5]] + [3.0, 0.0])
    assert (seeds.sd == 4 * SD_START).all()


def test_two_picks_at_one_blob_take_one_each():
    b, view = clip()
    both = Picks(np.zeros(2, int), np.array([0, 1]), b[[0, 0]] + [[0.5, 0.0], [1.0, 0.0]])
    chosen = _snapped(both, [0, 1], [view], 60.0).chosen
    assert len(set(chosen.tolist())) == 2
    assert 0 in chosen


def test_an_excluded_pair_is_not_taken():
    b, view = clip()
    seeds = _snapped(picks_at(b, [0]), [0], [view], 200.0, frozenset([(0, 0)]))
    nearest = np.argsort(np.linalg.norm(b - (b[0] + [3.0, -2.0]), axis=1))[1]
    assert seeds.chosen.tolist() == [nearest]


def test_the_picks_at_their_balls_come_first_then_as_they_are_then_others():
    b, view = clip()
    picks = picks_at(b, [0, 3, 7, 12, 14])
    first, second = _as_they_are([view], picks, 512)
    np.testing.assert_array_equal(first.xy, b[[0, 3, 7, 12, 14]])
    np.testing.assert_array_equal(second.xy, picks.xy)
    exchanged = list(_changed([view], picks, 512))[-10:]
    assert all(sorted(map(tuple, s.xy)) == sorted(map(tuple, first.xy)) for s in exchanged)
    assert all((s.xy != first.xy).any(1).sum() == 2 for s in exchanged)


@pytest.mark.slow
def test_picks_of_rows_that_are_mistyped_are_left_out_and_all_others_kept():
    b, view = clip(np.random.default_rng(1))
    points = POINTS.copy()
    points[[3, 12]] *= 25.4
    picks = picks_at(b, [0, 3, 5, 8, 12, 14])
    assert next(_in_agreement(points, [view], picks, (512, 480))).keep == [0, 2, 3, 5]
    (labels,) = label_from_picks(points, [view], picks, (512, 480))
    right = np.setdiff1d(ROW, [3, 12])
    np.testing.assert_array_equal(labels.blob[0][right], right)
    assert not np.isin(labels.blob[0][[3, 12]], right).any()


def test_four_good_picks_name_every_ball():
    b, view = clip(np.random.default_rng(0))
    (labels,) = label_from_picks(POINTS, [view], picks_at(b, [0, 3, 8, 13]), (512, 480))
    np.testing.assert_array_equal(labels.blob[0], np.arange(16))


def test_two_picks_are_too_few():
    b, view = clip()
    with pytest.raises(ValueError, match="2 picks leave the pose open; 4 are needed"):
        label_from_picks(POINTS, [view], picks_at(b, [0, 5]), (512, 480))


@pytest.mark.parametrize(
    ("p", "line"),
    [
        ([[0, 0, 0], [1, 1, 1]], True),
        ([[0, 0, 0], [1, 1, 1], [3, 3, 3]], True),
        ([[0, 0, 0], [1, 1, 1], [3, 3, 3.01]], True),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], False),
        ([[0, 0], [1, 0], [2, 0.3]], False),
    ],
)
def test_points_on_or_near_a_line(p, line):
    assert on_one_line(np.array(p, float)) == line
    assert on_one_line(np.array(p, float) * 1000 + 5) == line
