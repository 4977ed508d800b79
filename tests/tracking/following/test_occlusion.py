"""Targets that pass behind each other: nobody is measured in between, nobody comes out as somebody else."""

import numpy as np
import pytest

from tests.discs import disc
from tests.tracking.test_tracker import followed, positions, starts_at
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.following.occlusion import OCCLUSION, Occlusions, cleared, distinct, groups, touched
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MERGED, present

SHAPE = (120, 200)


def films(path, radius, *, noise=3.0, contrast=180.0):
    """Opaque discs: where one hides the other there is no more light than of one."""
    rng = np.random.default_rng(3)
    for k, at in enumerate(path):
        bare = np.prod([1 - disc(SHAPE, *p, radius) for p in at], axis=0)
        picture = 30 + contrast * (1 - bare) + rng.normal(0, noise, SHAPE)
        yield Sample(np.clip(np.rint(picture), 0, 255).astype(np.uint8), float(k))


def passing(speed, apart, *, n=60, bend=0.0):
    """Two targets (n, 2, 2) px that pass each other with `speed` px a sample between them, `apart` px at nearest."""
    t = np.arange(n) - n / 2 + 0.3
    x, y = speed / 2 * t, apart / 2 + bend * t * t
    return np.stack([np.stack([100 + x, 60 + y], -1), np.stack([100 - x, 60 - y + 2 * bend * t * t], -1)], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "speed", "apart", "bend"),
    [(4, 2, 0, 0), (4, 2, 2, 0), (4, 1, 4, 0), (6, 2, 3, 0), (6, 4, 6, 0), (2.5, 2, 0, 0), (4, 2, 1, 0.01)],
)
def test_targets_that_pass_each_other_slowly_stay_who_they_are(radius, speed, apart, bend):
    path = passing(speed, apart, bend=bend)
    rows, _ = followed(list(films(path, radius)), starts_at(path[0]), detection=Detection(noise=3.0))
    error = np.hypot(*np.moveaxis(positions(rows) - path, -1, 0))
    gap = np.hypot(*(path[:, 0] - path[:, 1]).T) - 2 * radius
    sd = np.hypot(*rows.values[2:4])
    overlap = -gap / (2 * radius)
    assert np.nanmax(error[gap > 0]) < 0.06
    assert np.nanmax(error / sd) < 5
    assert not present(rows)[overlap > 0.75].any(), "what is hidden by so much is not measured"
    assert (rows.flag[~present(rows)] & MERGED > 0).all()
    assert present(rows)[overlap < 0.5].mean() > 0.93, "half hidden they are fitted together"


def test_one_that_vanishes_in_a_meeting_does_not_hold_the_other_for_ever():
    path = passing(4, 0.5, n=120)[20:100]
    hidden = path.copy()
    hidden[42:, 1] = -50.0
    rows, _ = followed(list(films(hidden, 4)), starts_at(path[0]), detection=Detection(noise=3.0))
    assert present(rows)[-20:, 0].all()
    assert np.nanmax(np.abs(positions(rows)[-20:, 0] - path[-20:, 0])) < 0.2
    assert not present(rows)[-20:, 1].any()


@pytest.mark.parametrize("hz", [0.3, 1.0, 1.5])
def test_a_course_follows_the_bend_of_waves(hz):
    """30 px to and fro at 30 samples a second: two samples on it is off by 5.5 px at most, a long one by 9 to 34."""
    w = 2 * np.pi * hz / 30
    for phase in np.arange(0, 2 * np.pi, 0.5):
        t = np.arange(24.0)
        swing = 30 * np.sin(w * np.arange(28.0) + phase)
        seen = np.stack([swing[:24] + 100, 0 * t + 60], axis=-1)[:, None]
        occlusions = Occlusions(1)
        occlusions.begin(np.array([0]), t, seen + np.random.default_rng(0).normal(0, 0.02, seen.shape))
        ahead = occlusions.at(np.array([0]), np.array([24.0, 25.0]))[:, 0]
        assert np.abs(ahead[:, 0] - 100 - swing[24:26]).max() < 5.5


@pytest.mark.parametrize("hz", [0.3, 1.5])
def test_how_far_a_course_goes_astray_is_seen_by_how_it_went_before(hz):
    """60 px to and fro at 30 samples a second. What a parabola fits does not go astray."""
    w, far = 2 * np.pi * hz / 30, []
    for phase in np.arange(0, 2 * np.pi, 0.5):
        swing = 160 + 60 * np.sin(w * np.arange(16.0) + phase)
        occlusions = Occlusions(1)
        occlusions.begin(np.zeros(1, int), np.arange(12.0), np.stack([swing[:12], 0 * swing[:12]], -1)[:, None])
        off = occlusions.at(np.zeros(1, int), np.array([14.0]))[0, 0, 0] - swing[14]
        far.append([abs(off), *(occlusions.astray(np.zeros(1, int), time)[0] for time in (14.0, 15.0, 40.0))])
    off, soon, later, late = np.array(far).T
    assert (off < 2.5 * soon + 0.3).all()
    assert (soon < 1.0 if hz < 1 else soon > 3.0).all()
    assert np.allclose(later, 16 / 9 * soon)
    assert (late <= OCCLUSION.astray_px).all()
    straight = np.stack([np.arange(12.0) * 3, np.arange(12.0) ** 2 / 5], axis=-1)[:, None]
    for known in (straight, straight[-4:] + np.array([[[0.0, 0]], [[9, 0]], [[0, 9]], [[5, 5]]])):
        occlusions = Occlusions(1)
        occlusions.begin(np.zeros(1, int), np.arange(float(len(known))), known)
        assert occlusions.astray(np.zeros(1, int), len(known) + 3.0) < 0.1


def test_the_way_to_its_first_sample_is_the_course_of_a_target_that_touches_as_soon_as_it_begins():
    times = np.arange(-4.0, 1.0)
    straight = np.array([50.0, 60.0]) + times[:, None] * (3.0, -8.0)
    way = np.stack([straight, np.full((5, 2), np.nan), np.full((5, 2), np.nan)], axis=1)
    way[-1, 1] = 90.0, 60.0  # of one place no course is known
    who = np.arange(3)
    occlusions = Occlusions(3)
    occlusions.begin(who, np.zeros(0), np.zeros((0, 0, 2)), (times, way))
    assert occlusions.met.tolist() == [True, False, False]
    once = np.full((1, 3, 2), np.nan)
    once[0, 0] = straight[-1]
    for recorded in (np.zeros((0, 3, 2)), once):
        occlusions = Occlusions(3)
        occlusions.begin(who, np.zeros(len(recorded)), recorded, (times, way))
        assert np.allclose(occlusions.at(who[:1], np.array([2.0]))[0, 0], [56.0, 44.0], atol=0.1)
    for beside, then in ((1.0, [59.0, 36.0]), (28.0, [53.0 + 28.0, 52.0])):  # a way of two in one leads nowhere
        occlusions = Occlusions(3)
        occlusions.begin(who, np.zeros(0), np.zeros((0, 0, 2)), (times, way))
        occlusions.seen(who[:1], 1.0, np.array([[53.0 + beside, 52.0]]))
        assert np.allclose(occlusions.at(who[:1], np.array([3.0]))[0, 0], then, atol=4 * (beside < 4) + 0.1)
    longer = np.tile([[[70.0, 70.0]]], (8, 3, 1))
    occlusions = Occlusions(3)
    occlusions.begin(who, np.arange(-7.0, 1.0), longer, (times, way))
    assert np.allclose(occlusions.at(who, np.array([2.0])), 70.0)


def test_neither_of_two_that_touch_is_clear_unless_both_are():
    size = np.full((4, 2), 8.0)
    position = np.array([[[20.0, 20], [29, 20], [60, 60], [100, 20]]])
    clear = np.array([[True, False, False, True]])
    clear = cleared(clear, position, size)
    assert clear.tolist() == [[False, False, False, True]]
    clear = np.ones((1, 4), bool)
    clear = cleared(clear, position, size)
    assert clear.all()
    position[0, 1] = [22, 21]  # two centroids of one blob
    clear = cleared(clear, position, size)
    assert clear.tolist() == [[False, False, True, True]]
    assert touched(position[0], size).tolist() == [True, True, False, False]
    assert [g.tolist() for g in groups(position[0], size, 4.0)] == [[0, 1], [2], [3]]


def test_the_sweep_finds_the_same_as_asking_everybody_about_everybody():
    rng = np.random.default_rng(5)
    touched_any = 0
    for _ in range(300):
        n, k = rng.integers(1, 40), rng.integers(1, 9)
        moves = np.concatenate([rng.uniform(0, 150, (1, n, 2)), rng.normal(0, 3, (k - 1, n, 2))])
        position, size = np.cumsum(moves, axis=0), rng.uniform(3, 15, (n, 2))
        clear = rng.random((k, n)) < 0.8
        expected = clear.copy()
        for s in range(k):
            apart = np.abs(position[s, :, None] - position[s])
            both = (size[:, None] + size) / 2
            others = ~np.eye(n, dtype=bool)
            touching, one = (
                (apart < reach).all(axis=-1) & others
                for reach in (both + OCCLUSION.touching_px, OCCLUSION.inside * both)
            )
            expected[s] &= ~((touching & ~clear[s]).any(axis=1) | one.any(axis=1))
        touched_any += (expected != clear).any()
        clear = cleared(clear, position, size)
        assert np.array_equal(clear, expected)
    assert touched_any > 200


def course(positions, times=None):
    """The course of one target that hides after these positions (m, 2) px, and a function of its time."""
    positions = np.asarray(positions, float)
    times = np.arange(len(positions)) - len(positions) + 1.0 if times is None else times
    occlusions = Occlusions(1)
    occlusions.begin(np.array([0]), times, positions[:, None])
    return lambda *at: occlusions.at(np.array([0]), np.array(at, float))[:, 0]


def test_an_acceleration_lasts_for_some_samples_and_then_the_velocity_does():
    t = np.arange(-19.0, 1.0)
    at = course(np.stack([100 + 0.2 * t * t, 60 + t], -1))
    bends = np.diff(at(*range(21))[:, 0], 2)
    assert bends[: int(OCCLUSION.bending) - 2] == pytest.approx(0.4, abs=0.01)
    assert np.abs(bends[int(OCCLUSION.bending) :]).max() < 1e-9


def test_a_long_course_bears_its_noise_and_a_bent_one_is_followed_by_its_end():
    t = np.arange(-19.0, 1.0)
    line, wave = np.stack([100 + 2 * t, 60 + 0 * t], -1), np.stack([100 + 2 * t, 60 + 10 * np.sin(t / 5)], -1)
    off = [course(line + np.random.default_rng(k).normal(0, 0.05, line.shape))(4.0) - (108, 60) for k in range(20)]
    assert np.sqrt(np.mean(np.square(off))) < 0.1  # from its last four samples alone: 0.6
    assert np.abs(course(wave)(2.0) - (104, 60 + 10 * np.sin(2 / 5))).max() < 2  # through all of it: 3.5


def test_two_positions_go_on_straight_and_four_on_their_bend():
    assert course([(97.0, 60.0), (100.0, 58.0)])(1.0, 4.0) == pytest.approx(np.array([[103, 56], [112, 50]]), abs=0.3)
    t = np.arange(-3.0, 1.0)
    bent = np.stack([100 + t * t, 60 + 0 * t], -1)
    assert course(bent)(2.0)[0] == pytest.approx((104.0, 60.0), abs=0.2)


def test_two_that_may_as_well_have_changed_places_are_not_distinct():
    near = np.array([[0.0, 9.0], [9.0, 1.0]])  # squares of px
    assert distinct(near, np.array([0, 1]))
    assert not distinct(
        np.array([[2.0, 3.0], [3.0, 1.0]]), np.array([0, 1])
    )  # 3 against 6: no more than 4 between them
    assert distinct(np.ones((3, 3)), np.arange(3))


def test_another_track_that_touches_a_target_belongs_to_its_fit():
    occlusions, times = Occlusions(5), np.arange(8.0)
    place = np.array([[50.0, 50.0], [58.0, 50.0], [66.0, 50.0], [120.0, 50.0], [128.0, 50.0]])
    size, who = np.full((5, 2), 9.0), np.arange(5)
    assert not occlusions.with_targets(who, 1, 1.0, place, size).any()  # none of them hides another
    occlusions.begin(who, times, np.repeat(place[None], 8, axis=0))
    assert occlusions.with_targets(who, 1, 1.0, place, size).tolist() == [True, True, True, False, False]
    assert not occlusions.with_targets(who, 0, 1.0, place, size).any()
    occlusions.end(np.array([1]))
    assert occlusions.with_targets(who, 1, 1.0, place, size).tolist() == [True, False, False, False, False]
    occlusions.begin(who, times[:4], np.repeat(place[None], 4, axis=0))  # a spark beside it is gone before it is fitted
    assert occlusions.with_targets(who, 1, 1.0, place, size).tolist() == [True, False, False, False, False]
