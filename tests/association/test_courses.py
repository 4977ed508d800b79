"""The course of a group is where two of its cameras see it, and a joint course tells whose each place is."""

import numpy as np

from tests.association.swarm import as_tracklets, seen, swarm
from vidtrack.association.continuity import FLOOR, UNKNOWN, Motion
from vidtrack.association.courses import Course, courses, filled, rows_of, seam_evidence, stretches
from vidtrack.association.groups import nodes_of
from vidtrack.simulate.rig import thesis_rig


def rows(n_cameras=2):
    rng = np.random.default_rng(0)
    cameras = thesis_rig(n_cameras)
    p = swarm(1, rng)
    tracks, _ = seen(cameras, p, rng)
    tracks[1][:, 50:70] = np.nan
    pieces = [as_tracklets(t)[0] for t in tracks]
    return cameras, rows_of(pieces, nodes_of(pieces).begin, 0.0), p[0]


def test_a_course_has_a_place_wherever_two_cameras_see_it():
    cameras, r, p = rows()
    (course,) = courses(cameras, r, [(np.arange(len(r.node)), np.ones(len(r.node), int))])
    assert course.moment.tolist() == [*range(50), *range(70, 150)]
    assert np.abs(course.place - p[course.moment]).max() < 0.3  # 0.1 px of 0.25 in
    assert (course.source == 1).all()
    assert stretches(course) == [(0, 50), (50, 130)]


def test_a_joint_course_tells_which_part_each_place_rests_on():
    cameras, r, _ = rows()
    part = np.where((r.camera == 1) & (r.moment < 50), 2, 1)
    (course,) = courses(cameras, r, [(np.arange(len(r.node)), part)])
    assert course.source.tolist() == [3] * 50 + [1] * 80


def test_short_gaps_are_filled_by_straight_lines_and_long_ones_are_not():
    course = Course(np.array([0, 3, 9]), np.array([[0.0, 0], [3, 6], [9, 0]]), np.ones(3, int))
    whole = filled(course)
    assert whole.moment.tolist() == [0, 1, 2, 3, 9]
    assert whole.place[1].tolist() == [1.0, 2.0]


def test_only_the_seams_between_two_parts_are_judged():
    place = np.cumsum(np.random.default_rng(1).normal(0, 1, (300, 3)), 0)
    motion = Motion([place])
    one = Course(np.arange(60), place[:60], np.ones(60, int))
    assert seam_evidence(one, motion) == UNKNOWN
    two = one._replace(source=np.repeat([1, 2], 30))
    told = seam_evidence(two, motion)
    assert told.information > 0
    assert told.nats > seam_evidence(two._replace(place=place[:60] + np.repeat([0, 50], 30)[:, None]), motion).nats


def test_a_stretch_between_two_gaps_is_refuted_by_both_seams_no_more_than_by_one():
    # a ball may bounce at both ends of it
    rng = np.random.default_rng(1)
    place = np.sin(np.arange(300)[:, None] / 8 + [0, 1, 2]) + rng.normal(0, 1e-4, (300, 3))
    motion = Motion([place])
    moved = place[:90] + np.repeat([0, 1e6, 0], 30)[:, None]
    assert seam_evidence(Course(np.arange(90), moved, np.repeat([1, 2, 1], 30)), motion).nats == FLOOR


def test_several_gaps_of_one_course_are_filled_each_by_its_own_line():
    course = Course(np.array([0, 3, 4, 6]), np.array([[0.0], [3], [10], [14]]), np.ones(4, int))
    whole = filled(course)
    assert whole.moment.tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert whole.place[:, 0].tolist() == [0.0, 1, 2, 3, 10, 12, 14]


def test_what_the_calibration_leaves_widens_each_rows_sd_in_quadrature():
    tracks, _ = seen(thesis_rig(2), swarm(1, np.random.default_rng(0)), np.random.default_rng(0))
    pieces = [as_tracklets(t)[0] for t in tracks]
    wide = rows_of(pieces, nodes_of(pieces).begin, 0.3)
    plain = rows_of(pieces, nodes_of(pieces).begin, 0.0)
    assert np.allclose(wide.sd, np.hypot(plain.sd, 0.3))
