"""Tracklets of several cameras are joined to trajectories as far as that is beyond doubt, and no farther."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.association.swarm import T, as_tracklets, seen, swarm, who
from vidtrack.association.associate import NONE, _alternatives, _chosen, associate, associate_in_picture, most_at_once
from vidtrack.association.courses import Course
from vidtrack.association.tracklets import tracklets_of
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig


def associated(cameras, tracks, orders, **options):
    pieces, of = zip(*map(as_tracklets, tracks), strict=True)
    found = associate(cameras, pieces, **options)
    return found, who(found, of, orders), of


@pytest.mark.parametrize("n_cameras", [2, 3, 4])
def test_thirty_targets_each_lost_for_a_second_are_thirty_trajectories(n_cameras):
    rng = np.random.default_rng(n_cameras)
    cameras = thesis_rig(n_cameras)
    tracks, orders = seen(cameras, swarm(30, rng), rng)
    for track in tracks:
        for one in track:
            start = rng.integers(0, 120)
            one[start : start + 30] = np.nan
    found, told, _ = associated(cameras, tracks, orders, targets=30)
    assert sorted(map(sorted, (t for t, _ in told))) == [[k] for k in range(30)]
    assert all(n == n_cameras for _, n in told)
    assert (found.lead > np.log(1000)).all()


@pytest.mark.parametrize("unseen", [0, 2])
def test_balls_that_bounce_are_one_trajectory_each_though_their_tracklets_end_at_every_bounce(unseen):
    """unseen: samples after each bounce in which one of three cameras does not see the ball."""
    rng = np.random.default_rng(5)
    cameras = thesis_rig(3)
    t = np.arange(T.size)
    fall = [(t + phase) % 23 for phase in (3, 18)]
    up = np.stack([s * (22.5 - s) * 0.1 for s in fall])  # in: 13 up, at 2.3 a sample
    p = np.stack([np.stack([x + 0.05 * t, 0 * t, z - 6], axis=-1) for x, z in zip((-12, 10), up, strict=True)])
    tracks = [project(c, p) + rng.normal(0, 0.1, (2, t.size, 2)) for c in cameras]
    piece = np.stack([np.cumsum(np.diff(s, prepend=s[0]) < 0) for s in fall]) + np.array([[0], [10]])
    owner = np.unique(piece, return_inverse=True)[1].ravel()
    pieces = []
    for track, hidden in zip(tracks, (0, 0, unseen), strict=True):
        kept = (np.stack(fall) >= hidden).ravel()
        sd = np.full((kept.sum(), 2), 0.1)
        pieces.append(tracklets_of(owner[kept], np.tile(t, 2)[kept], track.reshape(-1, 2)[kept], sd))
    found = associate(cameras, pieces, targets=2)
    of = np.arange(pieces[0].n) >= len(np.unique(piece[0]))
    for own in found.trajectory:
        assert own.tolist() == of.astype(int).tolist()


def test_what_the_calibration_leaves_is_found_from_the_run():
    rng = np.random.default_rng(0)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(8, rng), rng)
    assert associated(cameras, tracks, orders)[0].bias_px < 0.1
    tracks[1] = tracks[1] + [0.0, 0.8]  # a camera that has turned a little
    found, told, _ = associated(cameras, tracks, orders)
    assert 0.3 < found.bias_px < 1
    assert sorted(map(sorted, (t for t, _ in told))) == [[k] for k in range(8)]


def test_one_target_that_is_drawn_aside_a_little_is_joined_though_all_others_are_better():
    """By light from one side, or a grain of the background: 0.03 px, where the sd of bright targets is 0.004 px."""
    rng = np.random.default_rng(0)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(8, rng), rng, noise=0.004)
    tracks[1][np.argsort(orders[1])[3]] += [0.0, 0.03]
    pieces, of = zip(*(as_tracklets(track, 0.004) for track in tracks), strict=True)
    found = associate(cameras, pieces)
    assert found.bias_px < 0.03
    assert sorted(map(sorted, (t for t, _ in who(found, of, orders)))) == [[k] for k in range(8)]


def test_a_few_bad_samples_part_no_tracklets():
    rng = np.random.default_rng(0)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(5, rng), rng)
    tracks[0][:, 40:44] += 200
    assert sorted(map(sorted, (t for t, _ in associated(cameras, tracks, orders)[1]))) == [[k] for k in range(5)]


def test_there_are_never_more_trajectories_than_targets():
    rng = np.random.default_rng(1)
    cameras = thesis_rig(3)
    tracks, orders = seen(cameras, swarm(4, rng), rng)
    for track, order in zip(tracks, orders, strict=True):
        track[order >= 2, 60:] = np.nan
    found, told, _ = associated(cameras, tracks, orders, targets=2)
    assert sorted(map(sorted, (t for t, _ in told))) == [[0], [1]]  # those seen longest
    assert {"surplus"} <= {w for reason in found.reason for w in reason} <= {"", "surplus"}


def test_of_few_targets_those_that_move_come_before_what_stands():
    rng = np.random.default_rng(1)
    cameras = thesis_rig(3)
    p = swarm(3, rng)
    p[0] = p[0, :1]
    tracks, orders = seen(cameras, p, rng)
    for track, order in zip(tracks, orders, strict=True):
        track[order != 0, 100:] = np.nan
    told = associated(cameras, tracks, orders, targets=2)[1]
    assert sorted(map(sorted, (t for t, _ in told))) == [[1], [2]]


def test_clutter_and_what_one_camera_alone_sees_are_of_no_trajectory_and_it_is_said_why():
    rng = np.random.default_rng(2)
    cameras = thesis_rig(2)
    p = swarm(3, rng)
    tracks, orders = seen(cameras, p, rng)
    keep = orders[1] != 0
    tracks[1], orders[1] = tracks[1][keep], orders[1][keep]
    tracks[0] = np.concatenate([tracks[0], np.broadcast_to([30.0, 400.0], (1, 150, 2))])
    orders[0] = np.append(orders[0], 9)
    found, told, _ = associated(cameras, tracks, orders)
    assert sorted(map(sorted, (t for t, _ in told))) == [[1], [2]]
    left = found.trajectory[0] == NONE
    assert set(orders[0][left]) == {0, 9}
    assert (found.reason[0][left] == "alone").all()


def test_two_targets_in_one_epipolar_plane_are_contested_until_another_camera_settles_it():
    # both swing along the line that joins the cameras: all views of both lie on one epipolar line
    along = thesis_rig(2)[1].position - thesis_rig(2)[0].position
    along /= np.linalg.norm(along)
    swing = np.sin(3 * T)[:, None] * along
    rng = np.random.default_rng(3)
    p = np.stack([4 * swing, 8 * along + 3 * swing[::-1]])
    tracks, orders = seen(thesis_rig(2), p, rng)
    found, told, _ = associated(thesis_rig(2), tracks, orders)
    assert told == []
    assert (np.concatenate(found.reason) == "contested").all()
    tracks, orders = seen(thesis_rig(3), p, rng)
    assert sorted(map(sorted, (t for t, _ in associated(thesis_rig(3), tracks, orders)[1]))) == [[0], [1]]


def test_when_all_cameras_are_blind_the_motion_tells_who_is_who():
    rng = np.random.default_rng(5)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(6, rng), rng)
    for track in tracks:
        track[:, 70:80] = np.nan
    told = associated(cameras, tracks, orders)[1]
    assert sorted(map(sorted, (t for t, _ in told))) == [[k] for k in range(6)]


def test_two_that_meet_in_the_one_picture_left_go_on_by_that_picture_while_the_other_camera_is_blind():
    cameras = thesis_rig(2)
    rng = np.random.default_rng(8)
    s = np.sin(1.2 * (T - 2.5))[:, None]
    p = np.stack([[0, 0, 0] + s * [6, 3, 2], [0, 0, 0] - s * [6, -3, 2]])
    p[1] += cameras[0].R[2] * 4  # behind the other one, as the first camera sees it
    tracks, orders = seen(cameras, np.concatenate([p, swarm(3, rng)]), rng)
    for row in np.flatnonzero(orders[0] < 2):
        tracks[0][row, 73:77] = np.nan
    tracks[1][:, 30:120] = np.nan
    told = associated(cameras, tracks, orders, targets=5)[1]
    assert sorted(map(sorted, (t for t, _ in told))) == [[k] for k in range(5)]
    assert all(n == 2 for _, n in told)


def test_targets_that_swap_places_unseen_are_not_guessed():
    # two at rest, nobody sees them for a second, two at rest half-way between: nothing tells which is which
    rng = np.random.default_rng(6)
    cameras = thesis_rig(3)
    p = np.zeros((2, 150, 3))
    p[0, :60] = [0, 0, 0]
    p[1, :60] = [10, 5, 0]
    p[0, 90:] = [5, -5, 3]
    p[1, 90:] = [5, 10, -3]
    tracks, orders = seen(cameras, p, rng)
    for track in tracks:
        track[:, 60:90] = np.nan
    for targets in (None, 2):
        found, told, _ = associated(cameras, tracks, orders, targets=targets)
        assert all(len(t) == 1 for t, _ in told)
        assert len(told) == 4
        # two stretches are of the two targets, and nothing says which is of which
        assert found.part_of == (((),) * 4 if targets is None else ((), (), (0, 1), (0, 1)))


def test_tracklets_that_share_no_moment_make_no_trajectory():
    rng = np.random.default_rng(6)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(1, rng), rng)
    tracks[0][:, :80] = np.nan
    tracks[1][:, 80:] = np.nan
    assert associated(cameras, tracks, orders)[0].m == 0


def test_no_tracklets_make_no_trajectories():
    assert associated(thesis_rig(2), [np.zeros((0, 5, 2))] * 2, [np.zeros(0, int)] * 2)[0].m == 0


def test_what_stands_in_two_cameras_is_no_target_where_much_else_stands_about():
    # 40 lamps in each picture, none of them the same: some lie on each other's epipolar lines
    rng = np.random.default_rng(7)
    cameras = thesis_rig(2)
    lamps = [np.repeat(rng.uniform(20, 460, (40, 1, 2)), 150, 1) + rng.normal(0, 0.1, (40, 150, 2)) for _ in cameras]
    ball = seen(cameras, swarm(1, rng), rng)[0]
    tracks = [np.concatenate(both) for both in zip(ball, lamps, strict=True)]
    orders = [np.array([0, *range(100 * (i + 1), 100 * (i + 1) + 40)]) for i in range(2)]
    found, told, _ = associated(cameras, tracks, orders)
    assert told == [({0}, 2)]
    reasons = np.concatenate(found.reason)
    assert (reasons == "surplus").sum() >= 4  # they do meet


def test_a_reflection_is_never_taken_for_the_target_and_is_said_to_be_one():
    rng = np.random.default_rng(8)
    cameras = thesis_rig(2)
    p = swarm(2, rng)
    p[1] = p[0] * (1, 1, -1) - (0, 0, 24)  # in still water below
    tracks, orders = seen(cameras, p, rng)
    for targets in (1, 2, None):
        found, told, _ = associated(cameras, tracks, orders, targets=targets)
        assert told == [({0}, 2)]
        assert [(one.reason, one.of) for one in found.left] == [("mirror", 0)]
        assert all(set(reason) == {"", "mirror"} for reason in found.reason)


def test_what_is_located_besides_the_targets_asked_for_is_listed_with_its_place():
    rng = np.random.default_rng(9)
    cameras = thesis_rig(2)
    p = swarm(4, rng)
    tracks, orders = seen(cameras, p, rng)
    found, told, _ = associated(cameras, tracks, orders, targets=2)
    assert len(told) == 2
    places = {tuple(np.round(one.place).tolist()) for one in found.left}
    others = {0, 1, 2, 3} - set.union(*(t for t, _ in told))
    assert places == {tuple(np.round(p[k].mean(0)).tolist()) for k in others}
    assert all((one.first, one.last, one.n, one.reason) == (0, 149, 150, "surplus") for one in found.left)


def test_each_tracklet_is_listed_with_what_holds_it_to_its_trajectory():
    rng = np.random.default_rng(10)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(5, rng), rng)
    tracks[0][:, 70:80] = np.nan
    found, _, of = associated(cameras, tracks, orders, targets=5)
    owner = [order[o] for order, o in zip(orders, of, strict=True)]
    tied = [(i, k, *ties.fellow[k]) for i, ties in enumerate(found.ties) for k in np.flatnonzero(ties.lead > 0)]
    assert len(tied) == 10  # of three tracklets of a target two are joined with another one
    assert all(owner[i][k] == owner[j][fellow] for i, k, j, fellow in tied)
    assert all(np.isfinite(ties.lead[ties.fellow[:, 0] >= 0]).all() for ties in found.ties)
    rivals = [
        owner[j][r] != owner[i][k] for i, t in enumerate(found.ties) for k, (j, r) in enumerate(t.rival) if j >= 0
    ]
    assert all(rivals)


def test_start_boxes_settle_what_lines_of_sight_leave_open_and_are_refuted_by_those_that_do_not():
    along = thesis_rig(2)[1].position - thesis_rig(2)[0].position
    along /= np.linalg.norm(along)
    swing = np.sin(3 * T)[:, None] * along
    rng = np.random.default_rng(3)
    cameras = thesis_rig(2)
    p = np.stack([4 * swing, 8 * along + 3 * swing[::-1]])
    tracks, orders = seen(cameras, p, rng)
    named = [["ab"[k] for k in order] for order in orders]
    told = associated(cameras, tracks, orders, targets=2, names=named)[1]
    assert sorted(map(sorted, (t for t, _ in told))) == [[0], [1]]
    tracks, orders = seen(cameras, swarm(2, rng), rng)
    exchanged = [["ab"[k] for k in orders[0]], ["ba"[k] for k in orders[1]]]
    told = associated(cameras, tracks, orders, targets=2, names=exchanged)[1]
    assert sorted(map(sorted, (t for t, _ in told))) == [[0], [1]]


def test_of_few_targets_those_that_start_boxes_name_come_first():
    rng = np.random.default_rng(1)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(3, rng), rng)
    for track, order in zip(tracks, orders, strict=True):
        track[order == 2, 100:] = np.nan
    names = [["c" if k == 2 else "" for k in order] for order in orders]
    assert associated(cameras, tracks, orders, targets=1, names=names)[1] == [({2}, 2)]


@pytest.mark.parametrize("targets", [None, 4])
def test_tracklets_of_one_camera_are_joined_by_their_motion_in_its_picture(targets):
    rng = np.random.default_rng(2)
    camera = thesis_rig(1)
    tracks, orders = seen(camera, swarm(4, rng), rng)
    tracks[0][:, 60:66] = np.nan
    tracks[0][2, 100:104] = np.nan
    pieces, of = as_tracklets(tracks[0])
    found = associate_in_picture(pieces, targets=targets)
    assert sorted(map(sorted, (t for t, _ in who(found, [of], orders)))) == [[k] for k in range(4)]
    assert (found.lead > np.log(1000)).all()


def test_two_that_meet_in_the_only_picture_and_part_at_rest_are_not_guessed():
    t = np.arange(120)
    one, other = np.stack([100 + t, 100 + 0 * t], -1), np.stack([220 - t, 100 + 0 * t], -1)
    rng = np.random.default_rng(0)
    track = np.stack([one, other])[:, :, :] + rng.normal(0, 0.05, (2, 120, 2))
    track[:, 50:70] = np.nan
    assert (
        len(who(associate_in_picture(as_tracklets(track)[0], targets=2), [as_tracklets(track)[1]], [np.arange(2)])) == 2
    )
    rest = track.copy()  # at rest behind the meeting, each where the other one might have come to rest as well
    rest[:, 70:] = np.array([[150.0, 100], [170, 100]])[:, None] + rng.normal(0, 0.05, (2, 50, 2))
    rest[:, :50] = np.array([[160.0, 90], [160, 110]])[:, None] + rng.normal(0, 0.05, (2, 50, 2))
    found = associate_in_picture(as_tracklets(rest)[0], targets=2)
    assert found.part_of == ((), (), (0, 1), (0, 1))  # the chosen two are there at one moment


def test_what_one_camera_alone_shows_of_a_course_does_not_make_it_one_target_too_many():
    """Two hid each other: of their blob one camera had a track, which belongs to a course that is located later."""

    def course(first, last):
        moment = np.arange(first, last)
        return Course(moment, np.zeros((moment.size, 3)), np.ones(moment.size, np.intp))

    spans = {0: (0, 16), 1: (0, 16), 2: (8, 79), 3: (50, 79)}
    groups = SimpleNamespace(span=spans, value=lambda g, h: 1.0)
    courses = {0: course(0, 17), 1: course(0, 17), 2: course(32, 80), 3: course(50, 80)}
    assert _alternatives(groups, courses, [2, 3], {}) == {0: (2, 3), 1: (2, 3)}
    courses[2] = course(8, 80)
    assert _alternatives(groups, courses, [2, 3], {}) == {0: (3,)}


def test_how_many_there_are_at_once_counts_both_ends():
    assert most_at_once([(0, 5), (5, 9), (6, 20)], 0, 20) == 2
    assert most_at_once([(0, 5), (6, 9)], 0, 20) == 1
    assert most_at_once([(0, 5), (7, 9)], 6, 6) == 0
    assert most_at_once([], 0, 9) == 0


def test_a_body_tells_its_targets_apart_after_a_stretch_in_which_nothing_was_seen():
    rng = np.random.default_rng(4)
    cameras = thesis_rig(2)
    body = {"bow": (6.0, 0.0, 0.0), "stern": (-4.0, 0.0, 0.0), "mast": (0.0, 1.0, 5.0)}
    turn = np.where(T < 2.5, 0.2 * np.sin(T), 2.5 + 0.2 * np.sin(T))  # turned by hand meanwhile
    R = (
        np.stack([[np.cos(a), -np.sin(a), 0 * a] for a in turn]),
        np.stack([[np.sin(a), np.cos(a), 0 * a] for a in turn]),
    )
    axes = np.stack([*R, np.tile([0.0, 0.0, 1.0], (T.size, 1))], 1)
    shift = np.stack([3 * np.sin(2 * T), np.cos(3 * T), 0 * T], -1)
    p = np.stack([shift + axes @ np.array(place) for place in body.values()])
    tracks, orders = seen(cameras, p, rng)
    for track in tracks:
        track[:, 55:100] = np.nan
    blind = associated(cameras, tracks, orders, targets=3)[1]
    assert len(blind) > 3 or any(len(t) > 1 for t, _ in blind)
    found, told, _ = associated(cameras, tracks, orders, targets=3, bodies=[body])
    assert [{name} for name in found.names] == [{list(body)[k] for k in t} for t, _ in told]
    assert sorted(map(sorted, (t for t, _ in told))) == [[0], [1], [2]]


def test_a_few_fixes_are_no_trajectory_where_another_has_many():
    def course(k: int) -> Course:
        return Course(np.arange(k), np.zeros((k, 3)), np.zeros(k, np.intp))

    assert _chosen({3: course(40), 7: course(4)}, None, None) == [3]
    assert _chosen({3: course(3), 7: course(3)}, None, None) == [3, 7]
