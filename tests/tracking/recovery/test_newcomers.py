"""Whatever can be a target is followed, whenever and wherever it comes; and no target twice."""

import numpy as np
import pytest

from tests.discs import picture
from tests.tracking.test_tracker import DETECTION, SHAPE, circle, samples_of, starts_at
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.static_clutter import static_clutter
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.recovery.newcomers import INITIATION, Newcomers
from vidtrack.tracking.state import TargetState, present
from vidtrack.tracking.tracker import Tracker

NOWHERE = np.full(2, np.nan)


def followed(path, starts, *, still=(), opening=12):
    return followed_through(samples_of(path, still=still), starts, opening=opening)


def followed_through(samples, starts, *, opening=12):
    backgrounds = background_of(samples[:opening], DETECTION)
    static = static_clutter(samples[:opening], backgrounds, DETECTION, np.zeros((0, 4)))
    whole = WholePicture(backgrounds, DETECTION, static)
    tracker = Tracker(starts_at(starts), DETECTION, 100.0, static=static, whole=whole)
    tracker.follow(samples)
    tracker.finish()
    return tracker.rows(), tracker.others(), tracker


def with_one_more(path, other):
    return np.concatenate([path, other[:, None]], axis=1)


def test_a_thing_that_comes_late_is_followed_within_a_few_samples():
    late = np.tile(NOWHERE, (80, 1))
    late[30:] = np.stack([40 + 2.0 * np.arange(50), np.full(50, 30.0)], axis=-1)
    path = circle(80)
    rows, others, _ = followed(with_one_more(path, late), path[0])
    assert present(rows).all()
    assert set(others.track) == {1}
    assert others.sample.min() <= 30 + INITIATION.every + 1
    assert np.nanmax(np.abs(others.values[:2].T - late[others.sample])) < 0.1
    assert np.isfinite(others.values[0]).all()


def along_a_rope(path, speed=7.0):
    """Samples of a ball on a path, and one that rises before a rope from sample 10 on, and its places."""
    samples = samples_of(path)
    place = np.stack([np.full(len(path), 62.4), 185 - speed * (np.arange(len(path)) - 10)], axis=-1)
    for k, sample in enumerate(samples):
        if k >= 10:
            sample.luma[:] = np.maximum(sample.luma, picture(SHAPE, [(*place[k], 4.0)], contrast=180.0))
        sample.luma[:, 58:61] = 140
    return samples, place


def test_what_comes_along_a_rope_and_is_never_seen_apart_is_followed():
    path = circle(34)
    samples, place = along_a_rope(path)
    _, others, _ = followed_through(samples, path[0])
    seen = np.isfinite(others.values[0])
    assert set(range(17, 34)) <= set(others.sample[seen].tolist())
    error = others.values[:2, seen].T - place[others.sample[seen]]
    assert (np.abs(error) < 5 * others.values[[2, 3]][:, seen].T).all()
    assert np.abs(error).max() < 0.3


def test_without_anything_else_nothing_else_is_followed():
    path = circle(60, 3)
    rows, others, _ = followed(path, path[0], still=[(20.0, 20.0, 4.0), (280.0, 180.0, 4.0)])
    assert present(rows).all()
    assert not others.track.size


def test_what_rested_in_the_opening_is_followed_once_it_moves():
    """It was background at first; where it had been is uncovered, and it counts as clutter no more."""
    x = np.where(np.arange(90) < 25, 60.0, 60 + 1.5 * (np.arange(90) - 25))
    rested = np.stack([x, np.full(90, 30.0)], axis=-1)
    path = circle(90)
    rows, others, tracker = followed(with_one_more(path, rested), path[0])
    assert present(rows).all()
    seen = others.sample[np.isfinite(others.values[0])]
    assert set(range(55, 90)) <= set(seen.tolist())
    assert tracker.scene.static is None or not tracker.scene.static.touched(
        samples_of(path[:1]), np.array([[60.0]]), np.array([[30.0]]), 9.0, 9.0
    )


def test_a_target_that_jumps_is_taken_back_from_the_track_that_found_it():
    path = circle(60)
    path[30:, 0, 0] = 300 - path[30:, 0, 0]
    rows, others, tracker = followed(path, path[0])
    assert present(rows)[-15:].all()
    assert (tracker.state.missing[1:] < 0).all(), "no other track goes on beside the target"
    together = others.sample[np.isfinite(others.values[0])]
    assert (together < 45).all()


def test_a_track_that_is_lost_gives_its_place_back():
    late = np.tile(NOWHERE, (60, 1))
    late[10:40] = np.stack([40 + 2.0 * np.arange(30), np.full(30, 30.0)], axis=-1)
    path = circle(60)
    _, others, tracker = followed(with_one_more(path, late), path[0])
    assert others.track.size
    assert (tracker.newcomers.track[1:] == -1).all()


@pytest.mark.parametrize("n", [1, 5])
def test_what_the_targets_show_does_not_depend_on_what_else_is_followed(n):
    path = circle(60, n)
    late = np.tile(NOWHERE, (60, 1))
    late[20:] = np.stack([20 + 1.0 * np.arange(40), np.full(40, 20.0)], axis=-1)
    alone, _, _ = followed(path, path[0])
    rows, others, _ = followed(with_one_more(path, late), path[0])
    assert others.track.size
    off = np.abs(rows.values[:2] - alone.values[:2])
    assert off.max() < 0.06  # other noise


def test_of_two_halves_of_one_blob_a_target_turns_out_to_be_the_nearer_one():
    places = np.array([[50.0, 50.0], [100.0, 100.0], [106.0, 100.0], [200.0, 100.0]])
    starts = starts_at(places)._replace(pixels=np.full(4, 50.0), contrast=np.full(4, 120.0), size=np.full((4, 2), 16.0))
    state = TargetState.before(starts).started(np.arange(4), starts, 0.0)
    newcomers = Newcomers(1, 3, WholePicture({}, DETECTION, None), DETECTION)
    for at, partner, ended in (
        ([105.0, 100.0], [-1, 2, 1, -1], [2]),  # as near as both are, it is one of them
        ([105.0, 100.0], [-1, -1, -1, -1], [1, 2]),
        ([105.0, 100.0], [2, -1, 0, -1], [1]),  # its own half is another thing
        ([150.0, 100.0], [-1, 2, 1, -1], []),
    ):
        after, twice = newcomers.yielding(state, np.array([at]).T, 1, np.array(partner))
        assert twice.tolist() == ended
        assert np.flatnonzero(after.missing < 0).tolist() == ended


def large_that_meet(k=60):
    """Samples of two balls of 12 px radius, opaque, the second of which comes late and goes over the first one."""
    t = np.arange(k)
    one = np.stack([60 + 1.5 * t, np.full(k, 100.0)], axis=-1)
    other = np.stack([230 - 2.4 * t, np.full(k, 106.0)], axis=-1)
    other[:20] = NOWHERE
    samples = samples_of(one[:, None], radius=12.0)
    for k, at in enumerate(other):
        if np.isfinite(at[0]):
            samples[k].luma[:] = np.maximum(samples[k].luma, picture(SHAPE, [(*at, 12.0)], contrast=180.0))
    return samples, one, other


def test_a_target_and_another_track_that_touch_are_measured_as_two():
    samples, one, _ = large_that_meet()
    rows, _, _ = followed_through(samples, one[:1])
    error = np.abs(rows.values[:2, :, 0].T - one)
    touching = slice(38, 42)
    assert present(rows)[touching].all()
    assert np.nanmax(error) < 0.1


def candidates(pixels, contrast):
    """Blobs of so many pixels and so much contrast, somewhere in the picture."""
    pixels, n = np.array(pixels), len(pixels)
    place, size = np.arange(n) * 40.0, np.full(n, 11)
    no, zero = np.zeros(n, bool), np.zeros(n)
    mass = pixels * np.array(contrast, float)
    return Blobs(place, place, pixels, mass, zero, zero, size, size, size, size, no, no, zero, zero, zero)


def test_what_is_far_larger_smaller_or_dimmer_than_every_target_is_no_candidate():
    """A hand, a gnat, a shadow: each would take one of the few places, and be located as a target."""
    starts = starts_at(circle(1)[0])._replace(pixels=np.array([100.0]), contrast=np.array([120.0]))
    state = TargetState.before(starts)
    newcomers = Newcomers(1, 4, WholePicture({}, DETECTION, None), DETECTION)
    found = candidates([100, 350, 30, 100, 450, 20, 100], [120, 120, 120, 40, 120, 120, 20])
    assert newcomers._like_targets(found, state).tolist() == [True] * 4 + [False] * 3
    # in the whole picture the soft edge belongs to it: 450 pixels may be a target of 318
    rough = newcomers._like_targets(candidates([450, 900], [120, 120]), state, INITIATION.edge_px)
    assert rough.tolist() == [True, False]
