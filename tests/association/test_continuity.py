"""Courses that go on over a gap are told from those that do not, by how the run's own targets move."""

import numpy as np
import pytest

from vidtrack.association.continuity import FLOOR, UNKNOWN, Motion, _log_t


def waves(n, rng, M=300, hz=(0.5, 0.8), noise=0.001):
    """Courses (n, M, 3) of targets that ride on the same two waves about places of their own."""
    t = np.arange(M)[:, None] / 30
    p = rng.uniform(-1, 1, (n, 1, 3))
    for f in hz:
        p = p + rng.uniform(0.03, 0.1, (n, 1, 3)) * np.sin(2 * np.pi * f * t + rng.uniform(0, 6.3, (n, 1, 3)))
    return p + rng.normal(0, noise, (n, M, 3))


@pytest.mark.parametrize("gap", [1, 2, 5, 15, 40])
def test_one_course_is_likelier_than_two_over_short_and_long_gaps(gap):
    rng = np.random.default_rng(gap)
    courses = waves(8, rng)
    motion = Motion(list(courses))
    fresh = waves(8, rng)  # others on the same waves
    right = [motion.evidence(c[40:100], c[99 + gap : 159 + gap], gap).nats for c in courses]
    wrong = [
        motion.evidence(c[40:100], d[99 + gap : 159 + gap], gap).nats
        for i, c in enumerate(courses)
        for j, d in enumerate(courses)
        if i != j
    ]
    assert min(right) > 3
    assert min(right) > max(wrong)
    assert max(wrong) < 0
    assert np.isfinite([motion.evidence(c[:3], c[2 + gap :][:3], gap).nats for c in fresh]).all()


def test_two_that_pass_through_one_place_are_told_apart_by_their_velocities():
    rng = np.random.default_rng(0)
    t = np.arange(-100, 100)[:, None] / 30
    courses = [c + rng.normal(0, 0.001, c.shape) for c in (t * [0.3, 0.1, 0], t * [-0.3, 0.1, 0.02])]
    motion = Motion(courses)
    (a, b), (c, d) = ((x[60:98], x[103:140]) for x in courses)
    assert motion.evidence(a, b, 6).nats > 5
    assert motion.evidence(c, d, 6).nats > 5
    assert motion.evidence(a, d, 6).nats < 0
    assert motion.evidence(c, b, 6).nats < 0


def test_a_bounce_is_no_jump_where_the_place_goes_on_from_one_moment_to_the_next():
    rng = np.random.default_rng(4)
    t = np.arange(300)[:, None] / 30
    falls = [
        np.c_[0.3 * t + i, 0 * t, 4.9 * (t % 0.8) * (0.8 - t % 0.8)] + rng.normal(0, 0.001, (300, 3)) for i in (0, 1)
    ]
    # stretches end where the ball turns: each tracklet is cut there
    motion = Motion([c[i : i + 24] for c in falls for i in range(0, 288, 24)])
    bounced = motion.evidence(falls[0][:24], falls[0][24:48], 1).nats
    other = motion.evidence(falls[0][:24], falls[1][24:48], 1).nats
    assert bounced > 0
    assert other < -5
    assert motion.evidence(falls[0][:24], falls[0][25:48], 2).nats < 0  # two may have passed each other in between


def test_a_jump_tells_no_more_than_its_floor_and_a_gap_that_was_never_measured_nothing():
    motion = Motion(list(waves(3, np.random.default_rng(1))))
    c = waves(1, np.random.default_rng(2))[0]
    assert motion.evidence(c[:30], c[31:60] + 1e3, 2).nats < -10
    assert motion.evidence(c[:30], c[31:60] + 1e30, 2).nats >= FLOOR
    assert motion.evidence(c[:30], c[31:60], 1000) == UNKNOWN
    assert Motion([np.zeros((0, 3))]).evidence(c[:30], c[31:60], 2) == UNKNOWN


def test_evidence_is_calibrated_noise_alone_makes_no_target_two():
    # half of true courses have a jump below the median; even the worst of many is not refuted
    rng = np.random.default_rng(3)
    courses = waves(10, rng, noise=0.01)
    motion = Motion(list(courses))
    told = [motion.evidence(c[s : s + 20], c[s + 23 : s + 43], 4).nats for c in courses for s in range(0, 240, 7)]
    assert min(told) > 0


@pytest.mark.parametrize("gap", [3, 6])
def test_two_that_pass_near_each_other_on_steep_waves_are_distinguished_by_the_course_before(gap):
    # waves of up to 1.5 Hz bend within a few samples: what a parabola through the last ones misses is more than
    # what the two are apart
    rng = np.random.default_rng(gap)
    courses = waves(3, rng, hz=(0.6, 1.1, 1.5), noise=0.0005)
    a, b = courses[:2] - courses[:2, 150:151]  # through one place at one moment
    motion = Motion([a[:149], a[150 + gap :], b[:149], b[150 + gap :], courses[2]])
    ends = [c[89:149] for c in (a, b)], [c[148 + gap : 208 + gap] for c in (a, b)]
    told = np.array([[motion.evidence(x, y, gap).nats for y in ends[1]] for x in ends[0]])
    assert np.trace(told) - np.trace(told[::-1]) > 10


def test_a_long_gap_is_known_to_say_less_than_a_short_one():
    c = np.cumsum(np.random.default_rng(4).normal(0, 1, (900, 3)), 0)  # a walk without aim
    motion = Motion([c])
    knows = [motion.evidence(c[:60], c[59 + gap : 119 + gap], gap).information for gap in (2, 6, 20)]
    assert knows == sorted(knows, reverse=True)
    assert knows[-1] > 0


def test_a_course_that_is_only_just_seen_is_predicted_backwards_from_what_follows():
    rng = np.random.default_rng(6)
    courses = waves(6, rng, hz=(0.6, 1.1, 1.5), noise=0.0005)
    motion = Motion(list(courses))
    short, long = courses[0, 97:100], courses[0, 105:165]
    wrong = [motion.evidence(short, c[105:165], 6).nats for c in courses[1:]]
    assert motion.evidence(short, long, 6).nats > max(wrong) + 10


def test_a_jump_far_beyond_the_usual_is_unlikely_but_not_as_a_normal_law_has_it():
    """Ten standard deviations are 50 nats by a normal law: a release or a knock would part every course."""
    assert -20 < _log_t(100.0, 0.0, 1) - _log_t(0.0, 0.0, 1) < -5
