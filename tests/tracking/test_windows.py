"""What is kept for a second search shows the right place, and is never too much."""

import numpy as np

from tests.discs import picture
from tests.tracking.test_tracker import DETECTION, starts_at
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.recovery.separation import Scene
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance, TargetState
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.windows import KEEPING, Keeping, Windows, no_disc

SHAPE = (120, 200)
SCENE = Scene(DETECTION, 100.0, np.zeros((2, 0)))


def looks(width, height, pixels):
    values = np.full((8, 1), np.nan)
    values[[0, 3, 4], 0] = pixels, width, height
    return Appearance(values)


def test_discs_are_discs_in_frames_and_fields_and_two_that_touch_are_none():
    assert not no_disc(looks(10, 10, 78), 1)[0]
    assert not no_disc(looks(10, 5, 39), 2)[0]
    assert no_disc(looks(16, 10, 130), 1)[0]
    assert no_disc(looks(15, 15, 130), 1)[0]  # side by side, on the slant
    assert not no_disc(looks(4, 3, 10), 1)[0]  # so small that a pixel more is nothing
    assert not no_disc(looks(np.nan, np.nan, np.nan), 1)[0]


def test_a_piece_is_that_part_of_the_sample_and_stays_in_it():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, SHAPE).astype(np.uint8)
    windows, state = Windows(2), TargetState.before(starts_at([[100.0, 60.0], [3.0, 118.0]]))
    state = state.missed(np.arange(2), 1)
    at = np.array([[100.0, 60.0], [3.0, 118.0]])
    windows.sought(SCENE, Sample(image, 0.0), 7, np.arange(2), at, np.full((8, 2), np.nan), state)
    assert [one.sample for one in windows.kept] == [7, 7]
    for one in windows.kept:
        rows, columns = one.grey.shape
        own = np.maximum(image[one.top : one.top + rows, one.left : one.left + columns], 1)
        assert np.array_equal(one.grey, own)
    middle = windows.kept[0]
    assert abs(middle.left + middle.grey.shape[1] / 2 - 100) < 2


def test_no_more_is_kept_than_there_is_room_for():
    image = np.full(SHAPE, 30, np.uint8)
    windows, state = Windows(1), TargetState.before(starts_at([[100.0, 60.0]])).missed(np.arange(1), 1)
    for k in range(400):
        nothing = np.full((8, 1), np.nan)
        windows.sought(SCENE, Sample(image, 0.0), k, np.arange(1), np.array([[100.0, 60.0]]), nothing, state)
    size = windows.kept[0].grey.size
    assert sum(one.grey.size for one in windows.kept) <= KEEPING.of_each + size
    assert len(windows.kept) < 400


def test_of_a_large_target_enough_samples_are_kept_and_of_all_no_more_than_there_is_room_for(monkeypatch):
    """Its pieces are so large that ten of them were all the room: an overlap lasts longer."""
    image = np.full((300, 400), 30, np.uint8)
    state = TargetState.before(starts_at([[200.0, 150.0]])).missed(np.arange(1), 1)
    monkeypatch.setattr(TargetState, "sizes", lambda self, lines: np.full((1, 2), 80.0))
    for most, n in ((KEEPING.most_bytes, KEEPING.many), (1_000_000, 25)):
        monkeypatch.setattr("vidtrack.tracking.windows.KEEPING", Keeping(most_bytes=most))
        windows = Windows(1)
        for k in range(100):
            nothing = np.full((8, 1), np.nan)
            windows.sought(SCENE, Sample(image, 0.0), k, np.arange(1), np.array([[200.0, 150.0]]), nothing, state)
        assert windows.kept[0].grey.size > KEEPING.of_each / 11
        assert len(windows.kept) == n


def test_the_tracker_keeps_what_a_hidden_target_s_place_shows():
    path = np.stack([40 + 2.0 * np.arange(40), np.full(40, 60.0)], axis=-1)
    rng = np.random.default_rng(1)
    samples = []
    for k, (x, y) in enumerate(path):
        hidden = 18 <= k < 23
        samples.append(Sample(picture(SHAPE, [] if hidden else [(x, y, 5)], noise=2.0, rng=rng), float(k)))
    tracker = Tracker(starts_at(path[:1]), DETECTION, 100.0)
    tracker.follow(samples)
    tracker.finish()
    assert {one.sample for one in tracker.windows.kept} == set(range(18, 23))
    for one in tracker.windows.kept:
        rows, columns = one.grey.shape
        assert one.left < path[one.sample, 0] < one.left + columns
        assert one.top < path[one.sample, 1] < one.top + rows


def test_the_tracker_keeps_what_the_samples_before_show_where_a_target_is_found_again_after_long():
    """Sought in every eighth sample alone, it is not where it was expected when it comes out again."""
    path = np.stack([40 + 2.0 * np.arange(64), np.full(64, 60.0)], axis=-1)
    path[20:, 1] += 30
    hidden, seen_from = np.arange(64) >= 20, 37
    hidden[seen_from:] = False
    rng = np.random.default_rng(1)
    every = [[] if h else [(x, y, 5)] for h, (x, y) in zip(hidden, path.tolist(), strict=True)]
    samples = [Sample(picture(SHAPE, own, noise=2.0, rng=rng), float(k)) for k, own in enumerate(every)]
    whole = WholePicture({0: np.full(SHAPE, 30, np.uint8)}, DETECTION, None)
    tracker = Tracker(starts_at(path[:1]), DETECTION, 100.0, whole=whole)
    tracker.follow(samples)
    tracker.finish()
    found = int(np.flatnonzero(np.isfinite(tracker.rows().values[0, seen_from:, 0]))[0]) + seen_from
    assert found > seen_from + 2
    for k in range(max(seen_from, found - KEEPING.before + 1), found):
        corners = [(one.left, one.top, *one.grey.shape[::-1]) for one in tracker.windows.kept if one.sample == k]
        x, y = path[k]
        assert any(a + 5 < x < a + w - 5 and b + 5 < y < b + h - 5 for a, b, w, h in corners), k
