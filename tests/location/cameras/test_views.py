"""What a camera saw, brought to other moments: positions, noise, flags and tracklets stay together."""

import numpy as np
import pytest

from vidtrack.association.associate import NONE
from vidtrack.location.cameras.views import (
    View,
    brought,
    by_trajectory,
    flags_by_trajectory,
    joined,
    of_samples,
    same_day,
    timecodes,
    tracklets_seen,
)
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]


def view(T=10, n=1, rate=30.0, b=None, sd=0.1, flag=None, piece=None, begin=0.0, name="cam1"):
    t = begin + np.arange(T) / rate
    b = np.stack([np.stack([100 + 3 * t, 50 - t], -1)] * n) if b is None else b
    piece = np.zeros((n, T), np.intp) + np.arange(n)[:, None] if piece is None else piece
    pieces = int(piece.max(initial=-1)) + 1
    return View(
        name,
        CAMERA,
        None,
        t,
        np.array([f"00:00:00:{k:02d}" for k in range(T)], object),
        [f"t{k + 1}" for k in range(n)],
        b,
        np.full(b.shape, sd),
        np.full((n, T), "", object) if flag is None else flag,
        True,
        piece,
        np.arange(pieces),
        np.zeros(pieces, bool),
    )


def test_at_its_own_moments_a_view_is_as_it_was():
    own = view()
    there = brought(own, own.t, own.t)
    np.testing.assert_array_equal(there.b, own.b)
    np.testing.assert_allclose(there.sd, own.sd)
    np.testing.assert_array_equal(there.piece, own.piece)
    assert not there.between


def test_a_straight_track_between_its_samples_is_the_straight_line():
    own = view()
    at = own.t[2:7] + 0.4 / 30
    there = brought(own, own.t, at)
    np.testing.assert_allclose(there.b[0], np.stack([100 + 3 * at, 50 - at], -1), atol=1e-9)
    assert there.between
    assert (there.piece == 0).all()


def test_noise_between_samples_is_that_of_the_worse_neighbour_times_what_interpolation_makes_of_it():
    """A cubic midway weighs four samples by -1/16, 9/16, 9/16, -1/16: sqrt(164)/16 of their noise."""
    own = view()
    own.sd[:, 4] = 0.3
    at = own.t[[4, 7]] + 0.5 / 30
    np.testing.assert_allclose(brought(own, own.t, at).sd[0, :, 0], np.sqrt(164) / 16 * np.array([0.3, 0.1]), rtol=1e-9)


def test_a_moment_between_two_samples_has_the_flags_of_both():
    flag = np.array([["", "clipped", "clipped", "small", "", "", "", "", "", ""]], object)
    own = view(flag=flag)
    there = brought(own, own.t, own.t[:5] + 0.5 / 30)
    assert there.flag[0].tolist() == ["clipped", "clipped", "clipped;small", "small", ""]
    outside = brought(own, own.t, np.array([-1.0, 5.0]))
    assert outside.flag[0].tolist() == ["", ""]
    assert np.isnan(outside.b).all()
    assert (outside.piece == NONE).all()


def test_between_two_tracklets_there_is_nothing():
    piece = np.array([[0] * 5 + [1] * 5])
    own = view(piece=piece)
    there = brought(own, own.t, own.t[[3, 4, 5]] + 0.5 / 30)
    np.testing.assert_array_equal(np.isnan(there.b[0, :, 0]), [False, True, False])
    assert there.piece[0].tolist() == [0, NONE, 1]


def test_a_camera_that_recorded_nothing_saw_nothing():
    there = brought(view(T=0), np.zeros(0), np.array([0.0, 1.0]))
    assert np.isnan(there.b).all()
    assert np.isnan(there.sd).all()
    assert (there.piece == NONE).all()
    assert there.flag.tolist() == [["", ""]]
    assert not there.between


@pytest.mark.parametrize(
    ("begins", "days"), [((86390.0, 5.0), [0, 1]), ((5.0, 86390.0), [0, -1]), ((5.0, 8.0), [0, 0])]
)
def test_time_code_that_passes_midnight_is_brought_to_the_first_camera_s_day(begins, days):
    views = same_day([view(begin=begin) for begin in begins])
    for moved, begin, day in zip(views, begins, days, strict=True):
        np.testing.assert_allclose(moved.t[0], begin + 86400 * day)
    empty = same_day([view(T=0), view(begin=90000.0)])
    assert empty[1].t[0] == 90000.0


def test_names_and_number_of_tracklets():
    own = view(n=3)._replace(tracks=["a", "", "c"])
    assert own.named == ["a", "c"]
    assert own.n_pieces == 3
    assert view(piece=np.full((1, 10), NONE)).n_pieces == 0


def test_a_start_box_names_the_tracklet_that_begins_in_it_and_no_other():
    own = view(n=2, piece=np.array([[0] * 5 + [1] * 5, [2] * 10]))
    assert own.given == ["", "", ""]
    assert own._replace(bound=np.array([True, False, False])).given == ["t1", "", ""]
    assert own._replace(bound=np.array([False, False, True])).given == ["", "", "t2"]


def test_tracklets_are_those_with_a_sample_by_their_numbers_in_the_camera():
    piece = np.array([[4, 4, NONE, 1, 1], [NONE, 7, 7, NONE, NONE]])
    b = np.arange(20.0).reshape(2, 5, 2)
    own = view(T=5, n=2, b=b, piece=piece)
    found, number = tracklets_seen(brought(own, own.t, own.t)._replace(piece=piece, b=b))
    assert number.tolist() == [1, 4, 7]
    assert found.n == 3
    assert found.sample.tolist() == [3, 4, 0, 1, 1, 2]
    np.testing.assert_array_equal(found.b, b[[0, 0, 0, 0, 1, 1], [3, 4, 0, 1, 1, 2]])


def test_tracks_are_put_together_by_trajectory():
    piece = np.array([[0, 0, NONE, 1], [2, 2, 2, NONE]])
    trajectory = np.array([1, 0, NONE])
    values = np.arange(8.0).reshape(2, 4, 1)
    np.testing.assert_array_equal(of_samples(piece, trajectory), [[1, 1, NONE, 0], [NONE] * 4])
    out = by_trajectory(values, piece, trajectory, 2)
    np.testing.assert_array_equal(out[:, :, 0], [[np.nan] * 3 + [3], [0, 1, np.nan, np.nan]])


def test_flags_are_joined_with_a_semicolon_and_nothing_with_nothing():
    a, b = np.array(["", "x", "", "x"], object), np.array(["", "", "y", "y"], object)
    assert joined(a, b).tolist() == ["", "x", "y", "x;y"]


def test_the_flag_of_a_missing_sample_goes_to_the_trajectory_that_was_seen_last_or_else_next():
    piece = np.array([[NONE, 0, NONE, 1, NONE]])
    flag = np.array([["lost", "", "hidden", "", "gone"]], object)
    own = view(T=5, flag=flag, piece=piece)
    seen = brought(own, own.t, own.t)._replace(flag=flag, piece=piece)
    out = flags_by_trajectory(seen, np.array([0, 1]), 3)
    assert out.tolist() == [["lost", "", "hidden", "", ""], ["", "", "", "", "gone"], [""] * 5]
    assert (flags_by_trajectory(seen, np.array([NONE, NONE]), 1) == "").all()


def test_a_common_moment_has_the_label_of_the_camera_whose_it_is():
    views = [view(T=3), view(T=3, begin=0.01)]
    at = np.array([views[0].t[1], views[1].t[2]])
    labels = timecodes(views, [v.t for v in views], at, np.array([0, 1]))
    assert labels.tolist() == ["00:00:00:01", "00:00:00:02"]
