"""Lost targets in drawn pictures: which are found again, and the reason why the others are not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.candidates import blobs_near, blobs_of
from vidtrack.tracking.following.own_size import OwnSize
from vidtrack.tracking.recovery.reacquisition import SEARCH, Reacquisition, Scene
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import (
    EDGE,
    LOST,
    MEASURED,
    MERGED,
    PREDICTED,
    RECOVERED,
    SMALL,
    Appearance,
    Searched,
    Starts,
    TargetState,
)

SHAPE = (120, 160)
RADIUS = 4.0
SCENE = Scene(Detection(noise=2.0), 100.0, np.zeros((2, 0)))


def sample(*discs, time=1.0, seed=0):
    return Sample(picture(SHAPE, discs, contrast=180.0, noise=2.0, rng=np.random.default_rng(seed)), time)


def lost(*positions, missing=2, box=30.0):
    """Discs of radius 4 that were last measured at these positions, in a sample that shows none of them yet."""
    position = np.array(positions)
    n = len(position)
    nothing, one = np.full((n, 2), np.nan), np.ones(n)
    area = np.pi * RADIUS**2
    starts = Starts(
        position,
        nothing,
        nothing,
        np.full((n, 2), box),
        np.zeros(n, int),
        area * one,
        180 * one,
        30 * one,
        np.full((n, 2), 9.0),
    )
    state = TargetState.before(starts).started(np.arange(n), starts, 0.0)
    state = replace(state, missing=np.full(n, missing))
    return Searched(state, np.full((MEASURED, n), np.nan), np.zeros(n, np.int64)), position


def sought(now, predicted, picture_of, *, far=False):
    n = len(predicted)
    return Reacquisition(SCENE, n, n, OwnSize(n), far=far).seek(now, picture_of, np.arange(n), predicted)


@pytest.mark.parametrize("missing", [1, 2])
def test_a_target_in_its_box_is_measured_and_marked_only_if_it_was_lost_before(missing):
    now = sought(*lost((60.0, 50.0), missing=missing), sample((66.3, 45.6, RADIUS)))
    assert np.abs(now.values[:2, 0] - (66.3, 45.6)).max() < 0.05
    assert now.flag[0] == (RECOVERED if missing > 1 else 0)
    assert now.state.missing[0] == 0


def test_targets_are_assigned_one_to_one_by_where_each_should_be():
    """The first blob is nearest to both; only one of them can be it."""
    now = sought(*lost((60.0, 50.0), (70.0, 50.0)), sample((64.0, 50.0, RADIUS), (78.0, 50.0, RADIUS)))
    assert np.abs(now.values[0] - (64.0, 78.0)).max() < 0.05


@pytest.mark.parametrize(
    ("discs", "why"),
    [
        ([], LOST),
        ([(40.0, 50.0, 9.0)], MERGED),  # five times its pixels: it lies in something larger
        ([(40.0, 50.0, 0.8)], SMALL),
        ([(40.0, 50.0, RADIUS, 40.0)], LOST),  # a quarter of its contrast
    ],
)
def test_what_cannot_be_the_target_is_no_measurement_and_its_reason_is_recorded(discs, why):
    now = sought(*lost((40.0, 50.0)), sample(*discs))
    assert np.isnan(now.values).all()
    assert now.flag[0] == why | PREDICTED


def test_a_target_that_the_edge_of_the_picture_cuts_is_missing_and_marked_edge():
    now = sought(*lost((3.0, 50.0)), sample((2.0, 50.0, RADIUS)))
    assert np.isnan(now.values).all()
    assert now.flag[0] == EDGE | PREDICTED


def test_one_blob_where_two_targets_should_be_is_neither():
    now = sought(*lost((59.0, 50.0), (61.0, 50.0)), sample((60.0, 50.0, RADIUS)))
    assert np.isnan(now.values).all()
    assert (now.flag == MERGED | PREDICTED).all()


def test_far_from_its_box_a_target_is_accepted_only_in_the_second_of_two_searches():
    search = Reacquisition(SCENE, 1, 1, OwnSize(1), far=True)
    now, predicted = lost((30.0, 50.0), missing=12)
    first = search.seek(now, sample((120.0, 60.0, RADIUS)), np.arange(1), predicted)
    assert np.isnan(first.values).all()
    assert first.flag[0] & LOST
    later = replace(now.state, missing=now.state.missing + 1, times=now.state.times + 1)
    second = search.seek(replace(now, state=later), sample((123.0, 60.0, RADIUS), time=2.0), np.arange(1), predicted)
    assert np.abs(second.values[:2, 0] - (123.0, 60.0)).max() < 0.05
    assert second.flag[0] == RECOVERED
    steps = np.diff(second.state.positions[-2:, 0], axis=0)
    assert np.abs(steps - (3.0, 0.0)).max() < 0.1, "it goes on with the velocity of the two detections"


def test_another_track_that_is_sought_among_the_targets_is_not_sought_in_the_whole_picture():
    now, predicted = lost((40.0, 60.0), (80.0, 60.0))
    search = Reacquisition(SCENE, 1, 2, OwnSize(2), far=True)
    found = search.seek(now, sample((130.0, 30.0, RADIUS)), np.arange(2), predicted)
    assert np.isnan(found.values[0]).all()


def test_a_target_that_bounced_is_found_at_once_where_it_can_have_gone():
    """It went on by 18 px a sample, and comes back by as much: 36 px from where it was expected."""
    now, last = lost((60.0, 50.0), missing=1)
    positions = now.state.positions.copy()
    positions[-2:] = last + np.array([-18.0, 0.0]) * np.arange(1, -1, -1)[:, None, None]
    now = replace(now, state=replace(now.state, positions=positions))
    expected = last + np.array([18.0, 0.0])
    back = sought(now, expected, sample((42.0, 50.0, RADIUS)))
    assert back.values[0, 0] == pytest.approx(42.0, abs=0.05)
    assert back.state.missing[0] == 0
    away = sought(now, expected, sample((8.0, 50.0, RADIUS)))  # farther than it can have gone
    assert away.flag[0] == LOST | PREDICTED


@pytest.mark.parametrize("longest", [5, 12])
def test_targets_that_hide_each_other_count_as_lost_after_max_occlusion(longest):
    now, position = lost((60.0, 50.0), (62.0, 50.0))
    scene = Scene(Detection(noise=2.0, max_occlusion=longest), 100.0, np.zeros((2, 0)))
    search, who = Reacquisition(scene, 2, 2, OwnSize(2), far=False), np.arange(2)
    search.occlusions.begin(who, np.arange(4.0), np.tile(position, (4, 1, 1)))
    for _ in range(longest):
        now = search.seek(now, sample(), who, position)
        assert search.occlusions.met.all()
    search.seek(now, sample(), who, position)
    assert not search.occlusions.met.any()


@pytest.mark.parametrize(("missing", "reached"), [(10, False), (11, True)])
def test_what_is_lost_for_long_may_be_anywhere_and_before_that_where_it_can_have_gone(missing, reached):
    """A target at rest: it is looked for about where it was, until so much time has gone by that nothing is known."""
    now, predicted = lost((30.0, 50.0), missing=missing)
    now = resting(now, predicted)
    search = Reacquisition(SCENE, 1, 1, OwnSize(1), far=True)
    blobs = blobs_of(sample((140.0, 100.0, RADIUS)), SCENE.detection, 100.0)
    assert search._within_reach(now, np.arange(1), predicted, blobs).tolist() == [[reached]]


@pytest.mark.parametrize(("off", "reached"), [(21.0 + 3 * 4, True), (21.0 + 3 * 6, False)])
def test_a_target_at_rest_may_set_off_while_it_is_lost(off, reached):
    """Half its box's diagonal, 21 px, and 5 px a sample for three samples."""
    now, predicted = lost((30.0, 50.0), missing=3)
    search = Reacquisition(SCENE, 1, 1, OwnSize(1), far=True)
    blobs = blobs_of(sample((30.0 + off, 50.0, RADIUS)), SCENE.detection, 100.0)
    found = search._within_reach(resting(now, predicted), np.arange(1), predicted, blobs)
    assert found.tolist() == [[reached]]


def resting(now, predicted):
    """With targets that have not moved in the samples before."""
    positions = np.repeat(predicted[None], len(now.state.positions), axis=0)
    return replace(now, state=replace(now.state, positions=positions))


@pytest.mark.parametrize(("later", "found"), [(6.0, True), (9.0, False)])
def test_a_second_sighting_confirms_the_first_as_far_as_a_target_goes_in_a_few_samples(later, found):
    """7 box diagonals of 14 px lie between the two: too far for 6 samples, and 8 are the most that count."""
    search = Reacquisition(SCENE, 1, 1, OwnSize(1), far=True)
    now, predicted = lost((15.0, 15.0), missing=12, box=10.0)
    search.seek(now, sample((20.0, 60.0, RADIUS)), np.arange(1), predicted)
    distance = 14.14 * (5.5 if found else 8.5)
    second = search.seek(now, sample((20.0 + distance, 60.0, RADIUS), time=1.0 + later), np.arange(1), predicted)
    assert bool(np.isfinite(second.values[0, 0])) == found


def meeting(*positions, missing=2, radius_of_box=30.0):
    """A search for targets that hide each other at these positions, and what it begins with."""
    now, predicted = lost(*positions, missing=missing, box=radius_of_box)
    n = len(predicted)
    search = Reacquisition(SCENE, n, n, OwnSize(n), far=False)
    search.occlusions.begin(np.arange(n), np.arange(-7.0, 1.0), np.repeat(predicted[None], 8, axis=0))
    search.separation.measured = lambda *_: None  # no fit of both
    return search, now, predicted


@pytest.mark.parametrize(("unsteady", "found"), [(0.0, False), (30.0, True)])
def test_after_an_occlusion_targets_are_sought_as_far_off_as_their_courses_went_before(unsteady, found):
    """They are expected 40 px apart and lie 13 and 14 px off; of two that may be anywhere neither is taken alone."""
    search, now, predicted = meeting((40.0, 50.0), (80.0, 50.0))
    search.occlusions._unsteady[:] = unsteady
    seen = search.seek(now, sample((53.0, 50.0, RADIUS), (66.0, 50.0, RADIUS), time=2.0), np.arange(2), predicted)
    assert np.isfinite(seen.values[0]).tolist() == [found, found]
    search, now, predicted = meeting((40.0, 50.0), (80.0, 50.0))
    search.occlusions._unsteady[:] = unsteady
    seen = search.seek(now, sample((41.0, 50.0, RADIUS), time=2.0), np.arange(2), predicted)
    assert np.isfinite(seen.values[0]).tolist() == [not found, False]


def test_one_target_that_nothing_shows_is_waited_for_no_longer_than_a_sighting_counts():
    search, now, predicted = meeting((60.0, 50.0))
    for _ in range(int(SEARCH.confirmed_within)):
        search.seek(now, sample(), np.arange(1), predicted)
        assert search.occlusions.met[0]
    search.seek(now, sample(), np.arange(1), predicted)
    assert not search.occlusions.met[0]


@pytest.mark.parametrize(("radius", "found"), [(RADIUS, True), (RADIUS * 1.26, False), (RADIUS * 0.7, False)])
def test_after_an_occlusion_each_blob_must_be_one_whole_target(radius, found):
    search, now, predicted = meeting((50.0, 50.0), (62.0, 50.0))
    search.scene = replace(SCENE, detection=Detection(noise=2.0, threshold=120.0))
    now = search.seek(now, sample((50.0, 50.0, RADIUS), (62.0, 50.0, radius)), np.arange(2), predicted)
    assert np.isfinite(now.values[0]).tolist() == [found, found]


def test_soft_edges_that_touch_are_parted_above_them():
    """A little out of focus, 10 px apart: half way up they are one blob, as their edges add up between them."""
    search, now, predicted = meeting((55.0, 50.0), (65.0, 50.0))
    bare = picture(SHAPE, [(55.0, 50.0, RADIUS), (65.0, 50.0, RADIUS)], contrast=180.0, dtype=float)
    soft = Sample(np.clip(np.rint(cv2.GaussianBlur(bare, (0, 0), 1.5)), 0, 255).astype(np.uint8), 1.0)
    looks = now.state.appearance.values.copy()
    looks[[1, 7]] = 130.0  # contrast and plateau of the two as they are
    now = replace(now, state=replace(now.state, appearance=Appearance(looks)))
    (level, _) = search._levels(now, np.arange(2))
    assert blobs_near(soft, SCENE.detection, np.array([[30.0, 30, 60, 40]]), np.array([level])).Xf.size == 1
    now = search.seek(now, soft, np.arange(2), predicted)
    assert np.abs(now.values[0] - (55, 65)).max() < 0.2


@pytest.mark.parametrize(("radius", "held"), [(RADIUS * 1.1, False), (RADIUS * 1.5, True)])
def test_targets_are_waited_for_anew_only_where_a_blob_may_hold_several(radius, held):
    search, now, predicted = meeting((58.0, 50.0), (62.0, 50.0))
    for _ in range(3):
        search.seek(now, sample((60.0, 50.0, radius)), np.arange(2), predicted)
    assert search.occlusions.waited.tolist() == ([0, 0] if held else [3, 3])


@pytest.mark.parametrize(("gap", "alone"), [(3.0, False), (6.0, True)])
def test_targets_that_have_hardly_parted_are_found_together_or_not_at_all(gap, alone):
    """Only one of them is seen, where either may be."""
    search, now, predicted = meeting((50.0, 50.0), (59.0 + gap, 50.0))
    now = search.seek(now, sample((50.0, 50.0, RADIUS)), np.arange(2), predicted)
    assert np.isfinite(now.values[0]).tolist() == [alone, False]


@pytest.mark.parametrize("fitted", [True, False])
def test_one_that_is_gone_does_not_keep_those_that_were_fitted_before_from_being_fitted(fitted):
    now, at = lost((60.0, 50.0), (67.6, 50.0), (64.0, 53.0))
    search = Reacquisition(SCENE, 3, 3, OwnSize(3), far=False)
    search.occlusions.begin(np.arange(3), np.arange(-2.0, 1.0), np.repeat(at[None], 3, axis=0))
    search.separation.fitted[:2] = fitted
    now = search.seek(now, sample((60.0, 50.0, RADIUS), (67.6, 50.0, RADIUS)), np.arange(3), at)
    assert np.isfinite(now.values[0]).tolist() == [fitted, fitted, False]
    if fitted:
        assert np.abs(now.values[:2, :2].T - at[:2]).max() < 0.15
