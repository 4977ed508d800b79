"""Positions that rest on chance or on lines of sight that miss are none; rows end where asked."""

import numpy as np

from vidtrack.geometry.triangulate import Located
from vidtrack.location.accepted import limits_of, rows_kept, without_chance, without_far


def located(n_cameras, disagree=(), miss=0.1):
    """One target at as many moments as numbers of cameras; 0: no fix."""
    n = np.array([n_cameras])
    found = (n > 0)[..., None]
    point = np.where(found, 1.0, np.nan) * np.ones(3)
    out = np.zeros(n.shape, bool)
    out[0, list(disagree)] = True
    return Located(
        point=point,
        covariance=np.zeros((*n.shape, 3, 3)),
        sigma=0.1 * point,
        miss=np.where(n > 0, miss, np.nan),
        n_cameras=n,
        error=np.zeros((3, *n.shape, 2)),
        left_out=np.zeros((3, *n.shape), bool),
        disagree=out,
        sd=0.1,
    )


def test_two_cameras_that_agree_among_many_disagreements_agree_by_chance_and_three_do_not():
    told = without_chance(located([2, 2, 3, 0, 0, 0], disagree=(3, 4, 5)))
    assert np.isfinite(told.point[0, :, 0]).tolist() == [False, False, True, False, False, False]
    assert told.disagree[0].tolist() == [True, True, False, True, True, True]
    assert told.n_cameras[0].tolist() == [0, 0, 3, 0, 0, 0]
    assert np.isnan(told.sigma[0, :2]).all()


def test_where_cameras_seldom_disagree_all_is_believed():
    whole = located([2] * 9 + [0], disagree=(9,))
    assert without_chance(whole).n_cameras.tolist() == whole.n_cameras.tolist()


def test_a_fix_that_lines_of_sight_miss_by_more_than_the_limit_is_none():
    told = without_far(located([2, 3], miss=0.2), 0.1)
    assert np.isnan(told.point).all()
    assert told.n_cameras.tolist() == [[0, 0]]
    assert np.isfinite(without_far(located([2, 3], miss=0.05), 0.1).point).all()


def test_short_targets_have_rows_from_their_first_fix_to_their_last_and_others_at_all_moments():
    point = np.full((3, 6, 3), np.nan)
    point[:2, [1, 4]] = 0.0
    kept = rows_kept(point, np.array([True, False, True]))
    assert kept.tolist() == [[False, True, True, True, True, False], [True] * 6, [False] * 6]


def test_a_measurement_may_lie_as_far_off_as_its_own_sd_or_the_usual_one_allows():
    sd = np.array([0.1, 0.1, 0.1, 4.0]).reshape(4, 1, 1, 1) * np.ones(2)
    b = np.zeros((4, 1, 1, 2))
    np.testing.assert_allclose(limits_of(sd, b, 3.0, 6.0).ravel(), [3, 3, 3, 24])
    np.testing.assert_allclose(limits_of(10 * sd, b, 3.0, 6.0).ravel(), [6, 6, 6, 240])
    b[:] = np.nan
    np.testing.assert_allclose(limits_of(np.full(b.shape, np.nan), b, 3.0, 6.0), 3.0)
