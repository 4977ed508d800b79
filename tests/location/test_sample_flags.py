"""The flag of each sample: why it has no fix, and what each camera said."""

import numpy as np

from tests.location.cameras.test_views import view
from vidtrack.geometry.triangulate import Located
from vidtrack.location.cameras.views import brought
from vidtrack.location.matching import Match
from vidtrack.location.sample_flags import sample_flags


def flags(
    lost=(), disagree=(), unseen=(), left_out=(), miss=0.0, said=("", ""), reason="", part_of=(), far=None, nothing=()
):
    """Flags (T,) of one target that two cameras see; lost and the others are samples."""
    T = 4
    rows = np.full((2, 1, T), "", object)
    rows[0, 0, 1], rows[1, 0, 1] = said
    views = [view(T=T, flag=own, name=name) for own, name in zip(rows, ("cam1", "cam2"), strict=True)]
    point = np.zeros((1, T, 3))
    point[0, list(lost)] = np.nan
    error = np.zeros((2, 1, T, 2))
    error[1, 0, list(unseen)] = np.nan
    out, no = np.zeros((2, 1, T), bool), np.zeros((1, T), bool)
    out[1, 0, list(left_out)] = True
    no[0, list(disagree)] = True
    n = np.full((1, T), 2, np.intp)
    located = Located(point, np.zeros((1, T, 3, 3)), point, np.full((1, T), miss), n, out, no, error, 0.1)
    whose, why = np.zeros(1, np.intp), np.array([reason], object)
    zero = np.zeros(1)
    match = Match(["t1"], (whose, whose), (why, np.array([""], object)), zero, zero, np.zeros(1, np.intp), 0.0, part_of)
    seen = [brought(own, own.t, own.t) for own in views]
    empty = np.zeros((1, T), bool)
    empty[0, list(nothing)] = True
    return sample_flags(views, seen, match, located, far, [no & False, empty])[0].tolist()


def test_a_fix_that_nothing_is_said_of_has_an_empty_flag():
    assert flags() == ["", "", "", ""]


def test_one_sight_is_lost_and_two_that_meet_nowhere_are_parallel():
    assert flags(lost=(1, 2), unseen=(2,)) == ["", "parallel", "lost", ""]


def test_cameras_that_disagree_are_named_before_what_each_camera_says():
    assert flags(lost=(1,), disagree=(1,), said=("edge", "occluded"))[1] == "disagree;cam1:edge;cam2:occluded"


def test_a_camera_that_was_left_out_is_named_after_its_own_flag():
    assert flags(left_out=(1, 3), said=("", "edge;edge")) == ["", "cam2:edge;cam2:left_out", "", "cam2:left_out"]


def test_a_fix_that_its_lines_miss_by_more_than_the_limit_is_far():
    assert flags(miss=0.5, far=0.4) == ["far"] * 4
    assert flags(miss=0.4, far=0.4) == [""] * 4


def test_tracklets_that_two_targets_claim_are_contested_and_open_trajectories_ambiguous():
    assert flags(reason="contested")[0] == "cam1:contested"
    assert flags(part_of=((0, 1),), said=("edge", ""))[:2] == ["ambiguous", "ambiguous;cam1:edge"]


def test_a_camera_that_shows_nothing_is_named_where_it_says_nothing_else():
    assert flags(nothing=(0, 1), said=("edge", "lost")) == ["cam2:unseen", "cam1:edge;cam2:lost", "", ""]
