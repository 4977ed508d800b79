"""The targets of a rigid body are known by their distances, as far as these say it."""

import numpy as np
import pytest

from vidtrack.association.courses import Course
from vidtrack.association.rigid_bodies import members_of
from vidtrack.motion.rigid import rotation_from_roll_pitch_yaw

FLOAT = {"bow": (6.0, 0.0, 0.0), "stern": (-4.0, 0.0, 0.0), "port": (0.0, 3.0, 1.0)}
T = np.arange(90) / 30


def ride(body, moments, rng, noise=0.005):
    """Courses of a body's targets that turn and drift, at some moments."""
    angles = np.stack([0.3 * np.sin(3 * T), 0.2 * np.sin(2 * T), 1.5 * T], -1)[moments]
    R = rotation_from_roll_pitch_yaw(angles)
    origin = np.stack([3 * T, np.cos(T), 0 * T], -1)[moments]
    places = [origin + R @ np.array(p) + rng.normal(0, noise, (len(moments), 3)) for p in body.values()]
    return [Course(np.asarray(moments), p, np.ones(len(moments), int)) for p in places]


def test_targets_are_recognised_before_and_after_a_blind_stretch():
    rng = np.random.default_rng(0)
    before, after = ride(FLOAT, np.arange(40), rng), ride(FLOAT, np.arange(60, 90), rng)
    courses = dict(zip((10, 11, 12, 22, 20, 21), [*before, *after], strict=True))
    told = members_of(courses, [FLOAT])
    assert told == {10: "bow", 11: "stern", 12: "port", 22: "bow", 20: "stern", 21: "port"}


def test_of_two_alike_arms_only_what_is_beyond_doubt_is_named():
    rng = np.random.default_rng(1)
    even = {"left": (-3.0, 0.0, 0.0), "right": (3.0, 0.0, 0.0), "mast": (0.0, 0.0, 5.0)}
    told = members_of(dict(enumerate(ride(even, np.arange(60), rng))), [even])
    assert told == {2: "mast"}


def test_what_swims_beside_a_body_is_none_of_its_targets():
    rng = np.random.default_rng(2)
    own = ride(FLOAT, np.arange(60), rng)
    stranger = Course(np.arange(60), own[0].place + 0.5 + np.sin(4 * T[:60, None]), np.ones(60, int))
    assert members_of(dict(enumerate([stranger, *own])), [FLOAT]) == {1: "bow", 2: "stern", 3: "port"}


def test_one_hidden_target_of_four_leaves_the_others_known_and_two_say_nothing():
    rng = np.random.default_rng(3)
    four = FLOAT | {"mast": (1.0, -1.0, 4.0)}
    courses = dict(enumerate(ride(four, np.arange(60), rng)))
    del courses[1]
    assert members_of(courses, [four]) == {0: "bow", 2: "port", 3: "mast"}
    del courses[3]
    assert members_of(courses, [four]) == {}


@pytest.mark.parametrize("off", [0.1, 0.8])
def test_places_that_were_measured_a_little_wrong_are_borne_and_wrong_ones_are_not(off):
    rng = np.random.default_rng(4)
    listed = FLOAT | {"bow": (6.0 + off, 0.0, 0.0)}
    told = members_of(dict(enumerate(ride(FLOAT, np.arange(60), rng))), [listed])
    assert bool(told) == (off < 0.2)


def test_each_of_two_bodies_has_its_own():
    rng = np.random.default_rng(5)
    other = {"a": (0.0, 0.0, 0.0), "b": (2.0, 0.0, 0.0), "c": (0.0, 4.5, 0.0)}
    far = [c._replace(place=c.place + 40) for c in ride(other, np.arange(60), rng)]
    told = members_of(dict(enumerate([*ride(FLOAT, np.arange(60), rng), *far])), [FLOAT, other])
    assert told == {0: "bow", 1: "stern", 2: "port", 3: "a", 4: "b", 5: "c"}


def test_rough_places_are_borne_as_far_as_their_noise_explains_it():
    """0.3 in of noise: distances scatter by 0.4 in, more than a survey may be wrong by, and their means by 0.12 in."""
    for seed in range(12):
        courses = dict(enumerate(ride(FLOAT, np.arange(12), np.random.default_rng(seed), noise=0.3)))
        assert members_of(courses, [FLOAT]) == {0: "bow", 1: "stern", 2: "port"}


def test_what_keeps_the_distance_of_a_target_on_average_alone_is_none():
    _, stern, port = ride(FLOAT, np.arange(60), np.random.default_rng(6))
    bow = ride(FLOAT, np.arange(60), np.random.default_rng(7))[0]
    along = bow.place - (stern.place + port.place) / 2
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    swinging = bow._replace(place=bow.place + 0.8 * np.sin(2 * np.pi * np.arange(60) / 30)[:, None] * along)
    assert members_of({0: swinging, 1: stern, 2: port}, [FLOAT]) == {}
    assert members_of({0: bow, 1: stern, 2: port}, [FLOAT]) == {0: "bow", 1: "stern", 2: "port"}


@pytest.mark.parametrize(("moments", "named"), [(4, 0), (5, 3)])
def test_a_few_moments_together_say_nothing_of_a_distance(moments, named):
    assert len(members_of(dict(enumerate(ride(FLOAT, np.arange(moments), np.random.default_rng(8)))), [FLOAT])) == named
