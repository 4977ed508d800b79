"""Tracks of several cameras are matched as wholes, one to one, and doubt is said."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.correspondence import NONE, by_target, match_errors, match_tracks
from vidtrack.simulate.rig import thesis_rig

T = np.arange(150) / 30


def swarm(n, rng):
    """Places (n, 150, 3), in, of targets that swing about 5 s long, each in its own way."""
    middle = rng.uniform(-1, 1, (n, 1, 3)) * (28, 12, 12)
    reach = rng.uniform(2, 6, (n, 1, 3))
    return middle + reach * np.sin(rng.uniform(2, 5, (n, 1, 1)) * T[:, None] + rng.uniform(0, 6, (n, 1, 3)))


def seen(cameras, p, rng, noise=0.1):
    """Each camera's tracks in an order of its own, and which target each is."""
    orders = [rng.permutation(len(p)) for _ in cameras]
    tracks = [
        project(c, p[o]) + rng.normal(0, noise, (len(p), p.shape[1], 2)) for c, o in zip(cameras, orders, strict=True)
    ]
    return tracks, orders


def wrong_and_right(match, orders):
    wrong = right = 0
    for k in range(len(match.error_px)):
        who = [o[t == k] for t, o in zip(match.target, orders, strict=True)]
        who = np.concatenate(who)
        right += len(who) == len(orders) and len(set(who)) == 1
        wrong += len(set(who)) > 1
    return wrong, right


@pytest.mark.parametrize("n_cameras", [2, 3, 4])
def test_thirty_targets_named_differently_are_all_matched(n_cameras):
    rng = np.random.default_rng(n_cameras)
    cameras = thesis_rig(n_cameras)
    tracks, orders = seen(cameras, swarm(30, rng), rng)
    for track in tracks:  # each lost for a second, some time
        for one in track:
            start = rng.integers(0, 120)
            one[start : start + 30] = np.nan
    match = match_tracks(cameras, tracks, tolerance_px=2.0)
    assert wrong_and_right(match, orders) == (0, 30)
    assert not match.ambiguous.any()
    # noise of .1 px in two pictures: .14 px from the curve, in the larger of the two distances
    assert match.error_px == pytest.approx(np.full(30, 0.14), abs=0.03)


def test_a_few_bad_samples_do_not_part_two_tracks():
    rng = np.random.default_rng(0)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(5, rng), rng)
    tracks[0][:, 40:44] += 200
    assert wrong_and_right(match_tracks(cameras, tracks, tolerance_px=2.0), orders) == (0, 5)


def test_there_are_never_more_targets_than_asked_for():
    rng = np.random.default_rng(1)
    cameras = thesis_rig(3)
    p = swarm(4, rng)
    tracks, _ = seen(cameras, p, rng)
    tracks[0][2:, 60:] = np.nan  # two of them in one camera only for a while
    match = match_tracks(cameras, tracks, tolerance_px=2.0, targets=2)
    assert len(match.error_px) == 2
    assert max(t.max() for t in match.target) == 1
    assert {int(k) for t in match.target for k in t if k != NONE} == {0, 1}
    assert (match.n_common == 150).all()  # those seen longest


def test_clutter_and_targets_of_one_camera_alone_are_left_over():
    rng = np.random.default_rng(2)
    cameras = thesis_rig(2)
    tracks, _ = seen(cameras, swarm(3, rng), rng)
    tracks[1] = tracks[1][:2]
    still = np.broadcast_to([30.0, 400.0], (1, 150, 2))
    tracks[0] = np.concatenate([tracks[0], still])
    match = match_tracks(cameras, tracks, tolerance_px=2.0)
    assert len(match.error_px) == 2
    assert (match.target[0] == NONE).sum() == 2
    assert match.target[0][3] == NONE


def test_two_targets_in_one_epipolar_plane_are_said_to_be_ambiguous():
    # both swing along the line that joins the cameras: all views of both lie on one epipolar line
    cameras = thesis_rig(2)
    along = cameras[1].position - cameras[0].position
    along /= np.linalg.norm(along)
    swing = np.sin(3 * T)[:, None] * along
    rng = np.random.default_rng(3)
    p = np.stack([4 * swing, 8 * along + 3 * swing[::-1]])
    tracks, _ = seen(cameras, p, rng)
    match = match_tracks(cameras, tracks, tolerance_px=2.0)
    assert len(match.error_px) == 2
    assert match.ambiguous.all()
    assert (match.runner_up_px < 2).all()
    third, orders = seen(thesis_rig(3), p, rng)  # another point of view settles it
    settled = match_tracks(thesis_rig(3), third, tolerance_px=2.0)
    assert wrong_and_right(settled, orders) == (0, 2)
    assert not settled.ambiguous.any()


def test_a_rival_within_the_tolerance_that_fits_much_worse_is_no_doubt():
    cameras = thesis_rig(2)
    rng = np.random.default_rng(4)
    p = swarm(2, rng) * 0.2
    p[1] = p[0] + [0.2, 2.0, 0]  # mostly along the epipolar lines, 1 px across them
    tracks, orders = seen(cameras, p, rng)
    match = match_tracks(cameras, tracks, tolerance_px=2.0)
    assert wrong_and_right(match, orders) == (0, 2)
    assert (match.runner_up_px < 2).all()
    assert not match.ambiguous.any()


def test_a_track_in_two_pieces_is_one_target():
    rng = np.random.default_rng(5)
    cameras = thesis_rig(2)
    tracks, _ = seen(cameras, swarm(3, rng), rng)
    piece = tracks[1][:1].copy()
    piece[:, :70] = np.nan
    tracks[1][0, 65:] = np.nan
    tracks[1] = np.concatenate([tracks[1], piece])
    match = match_tracks(cameras, tracks, tolerance_px=2.0)
    assert len(match.error_px) == 3
    assert match.target[1][3] == match.target[1][0] != NONE
    whole = by_target(tracks[1], match.target[1], 3)[match.target[1][0]]
    assert np.isnan(whole[:, 0]).sum() == 5


def test_tracks_that_share_no_moment_are_not_matched():
    rng = np.random.default_rng(6)
    cameras = thesis_rig(2)
    tracks, _ = seen(cameras, swarm(1, rng), rng)
    tracks[0][:, :80] = np.nan
    tracks[1][:, 80:] = np.nan
    assert not len(match_tracks(cameras, tracks, tolerance_px=2.0).error_px)
    assert np.isnan(match_errors(cameras, tracks)).all()


def test_no_tracks_make_no_targets():
    match = match_tracks(thesis_rig(2), [np.zeros((0, 5, 2)), np.zeros((0, 5, 2))], tolerance_px=2.0)
    assert not len(match.error_px)
    with pytest.raises(ValueError, match="tracks must be"):
        match_tracks(thesis_rig(2), [np.zeros((1, 5, 2)), np.zeros((1, 6, 2))], tolerance_px=2.0)
