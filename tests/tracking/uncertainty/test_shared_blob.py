"""While a target that was asked for has never been seen, a long blob may be two: half their distance is in its sd."""

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.state import MASS, MEASURED, MERGED, PIXELS, SD_X, SD_Y, XX, XY, YY, Rows, X, Y
from vidtrack.tracking.uncertainty.sd_scaling import grow_sd, others_with_grown_sd
from vidtrack.tracking.uncertainty.shape_change import ShapeEvidence
from vidtrack.tracking.uncertainty.shared_blob import lost_pairs_sd, shared_blob_sd

N = 12
TIME = np.arange(N, dtype=float)


def rows(second, other_from=N, speed=0.0):
    """A target with second moments xx, yy, xy that moves along x, and another that is seen from a sample on."""
    values = np.full((MEASURED, N, 2), np.nan)
    for row, value in ((Y, 30.0), (SD_X, 0.02), (SD_Y, 0.02), (PIXELS, 20.0), (MASS, 2000.0)):
        values[row, :, 0] = value
    values[X, :, 0] = 30 + speed * TIME
    values[[XX, YY, XY], :, 0] = np.array(second)[:, None]
    values[:, other_from:, 1] = values[:, other_from:, 0]
    return Rows(values, np.zeros((N, 2, 2)), np.zeros((N, 2), np.int64), np.zeros(N))


@pytest.mark.parametrize(("apart", "angle"), [(2.0, 0.0), (2.5, 0.7), (3.0, 2.0)])
def test_the_sd_of_a_blob_of_two_is_how_far_each_is_from_the_middle(apart, angle):
    step = apart / 2 * np.array([np.cos(angle), np.sin(angle)])
    both = [(20 + sign * step[0], 20 + sign * step[1], 2.0) for sign in (-1, 1)]
    light = sum(picture((41, 41), [ball], level=0.0, contrast=100.0, dtype=float) for ball in both)
    y, x = np.mgrid[:41, :41] - 20
    xx, yy, xy = ((light * a * b).sum() / light.sum() for a, b in ((x, x), (y, y), (x, y)))
    sd = shared_blob_sd(rows((xx, yy, xy)), TIME, 0.0)
    np.testing.assert_allclose(sd[:, 0], apart / 2, rtol=0.01)
    assert not sd[:, 1].any()


def test_a_round_blob_one_alone_and_one_whose_fellow_was_seen_are_one_target():
    assert not shared_blob_sd(rows((1.1, 1.0, 0.02)), TIME, 0.0).any()
    long = rows((2.0, 1.0, 0.0))
    alone = Rows(long.values[..., :1], long.corner[:, :1], long.flag[:, :1], long.total_pixels)
    assert not shared_blob_sd(alone, TIME, 0.0).any()
    np.testing.assert_array_equal(
        shared_blob_sd(rows((2.0, 1.0, 0.0), other_from=5), TIME, 0.0)[:, 0], [1] * 5 + [0] * 7
    )
    lost = rows((2.0, 1.0, 0.0), other_from=0)
    lost.values[:, 4:, 1] = np.nan
    assert not shared_blob_sd(lost, TIME, 0.0).any()


def test_a_streak_is_not_two():
    speed, exposure = 4.0, 0.9
    streak = (1.0 + exposure**2 * speed**2 / 12, 1.0, 0.0)
    assert shared_blob_sd(rows(streak, speed=speed), TIME, 0.0).any()
    assert not shared_blob_sd(rows(streak, speed=speed), TIME, exposure).any()


def test_it_is_in_the_sd_that_the_tracks_have():
    blob = rows((2.0, 1.0, 0.0))
    none = ShapeEvidence(blob.values[[X, Y]], np.zeros((2, N, 2)), 0.0, np.full((5, 2), np.nan))
    grow_sd(blob, TIME, none, lines=1, kind="weighted")
    assert (blob.values[[SD_X, SD_Y], :, 0] > 0.99).all()


def lost_in_each_other(second, *, flag=MERGED, again=N, at=(32.0, 30.0)):
    """Two round targets that are lost from sample 3 on, one of them to `again`, and a track that begins in sample 6."""
    alone = rows((2.0, 2.0, 0.0), other_from=0)
    alone.values[:, 3:again, 0] = alone.values[:, 3:, 1] = np.nan
    alone.flag[3:] = flag
    other = np.full((MEASURED, N - 6), np.nan)
    for row, value in zip((X, Y, PIXELS, XX, YY, XY), (*at, 40.0, *second), strict=True):
        other[row] = value
    sample = np.arange(6, N)
    return Others(np.full(sample.size, 7), sample, other, np.zeros(sample.size, np.int64)), alone


def test_what_is_found_where_two_were_lost_in_each_other_may_be_both():
    others, targets = lost_in_each_other((3.0, 2.0, 0.0))
    np.testing.assert_allclose(lost_pairs_sd(others, targets, TIME, 0.0), 1.0)
    others, targets = lost_in_each_other((3.0, 2.0, 0.0), again=9)
    np.testing.assert_allclose(lost_pairs_sd(others, targets, TIME, 0.0), [1, 1, 1, 0, 0, 0])


def test_what_is_round_or_elsewhere_or_where_targets_were_lost_otherwise_is_one():
    for changed in (
        lost_in_each_other((2.01, 2.0, 0.0)),
        lost_in_each_other((3.0, 2.0, 0.0), at=(90.0, 30.0)),
        lost_in_each_other((3.0, 2.0, 0.0), flag=0),
    ):
        assert not lost_pairs_sd(*changed, TIME, 0.0).any()


def test_what_targets_look_like_alone_makes_no_pair():
    """Pixels that are no squares make every disc as long."""
    others, targets = lost_in_each_other((3.0, 2.0, 0.0))
    targets.values[XX] *= 1.5
    assert not lost_pairs_sd(others, targets, TIME, 0.0).any()


def test_it_is_in_the_sd_that_other_tracks_have():
    others, targets = lost_in_each_other((3.0, 2.0, 0.0))
    others.values[[MASS, SD_X, SD_Y]] = np.array([[2000.0], [0.02], [0.02]])
    none = ShapeEvidence(targets.values[[X, Y]], np.zeros((2, N, 2)), 0.0, np.full((5, 2), np.nan))
    grown = grow_sd(targets, TIME, none, lines=1, kind="weighted")
    found = others_with_grown_sd(others, targets, TIME, grown, none, lines=1)
    assert (found.values[[SD_X, SD_Y]] > 0.99).all()
