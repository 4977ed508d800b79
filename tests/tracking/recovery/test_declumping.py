"""What was followed as one and is two: when it is looked at, how far back it was two, and what is measured then."""

import numpy as np
import pytest

from tests.tracking.recovery.test_separation import recorded
from vidtrack.stages.track import track
from vidtrack.tracking.discs.two_discs import Pair
from vidtrack.tracking.recovery.declumping import DECLUMPING, Clumps, first_of_both, looks_of
from vidtrack.tracking.state import MEASURED, PIXELS, XX, XY, YY, Appearance, TargetState, X

PAIR = Pair(
    np.zeros(2), np.zeros(2), np.log([[6.0, 6.0], [6.0, 6.0], [150.0, 140.0], [0.5, 0.5]]), np.full(2, 30.0), True
)


def state(missing, pixels=200.0):
    n = len(missing)
    nothing = np.full((8, n, 2), np.nan)
    looks = np.ones((8, n))
    looks[0] = pixels  # as they are on average
    return TargetState(Appearance(looks), np.array(missing), np.arange(8.0), nothing, np.full((n, 2), 50.0))


def values(pixels, xx, yy):
    out = np.full((MEASURED, len(pixels)), np.nan)
    out[[X, PIXELS, XX, YY, XY]] = np.stack([np.ones(len(pixels)), pixels, xx, yy, np.zeros(len(pixels))])
    return out


def test_what_is_long_and_large_and_measured_is_looked_at():
    clumps = Clumps(4)
    own = values([200.0, 200.0, 20.0, 200.0], [20.0, 16.0, 3.0, 20.0], [10.0, 16.0, 1.0, 10.0])
    assert clumps.due(own, state([0, 0, 0, 1]), 0, 1).tolist() == [0]
    # in fields a target has half as many pixels
    assert clumps.due(own, state([0, 0, 0, 1]), 0, 2).tolist() == [0, 2]


def test_two_looks_in_a_row_must_find_two_and_what_is_in_vain_is_looked_at_ever_less_often():
    clumps = Clumps(1)
    own = values([200.0], [20.0], [10.0])
    assert not clumps.looked(0, 0, PAIR)
    assert clumps.looked(0, 1, PAIR)
    assert not clumps.looked(0, 2, None)
    assert not clumps.due(own, state([0]), 3, 1).size
    assert clumps.due(own, state([0]), 2 + DECLUMPING.every, 1).size
    for _ in range(60):
        clumps.looked(0, 0, None)
    assert not clumps.due(own, state([0]), DECLUMPING.longest - 1, 1).size
    assert clumps.due(own, state([0]), DECLUMPING.longest, 1).size


def test_what_one_disc_explains_is_looked_at_again_when_it_is_longer_or_reaches_farther_than_then():
    clumps = Clumps(2)
    long, far = [20.0, 10.0], [16.3, 16.3]  # xx, yy
    as_then = values([200.0, 200.0], [long[0], far[0]], [long[1], far[1]])
    assert clumps.due(as_then, state([0, 0]), 0, 1).tolist() == [0, 1]
    for i in range(2):
        assert not clumps.looked(i, 0, None, one=True)
    later = DECLUMPING.longest + 1
    assert not clumps.due(as_then, state([0, 0]), later, 1).size
    assert clumps.due(values([200.0] * 2, [22.0, 16.3], [9.0, 16.3]), state([0, 0]), later, 1).tolist() == [0]
    assert clumps.due(values([200.0] * 2, [20.0, 16.7], [10.0, 16.7]), state([0, 0]), later, 1).tolist() == [1]
    assert clumps.due(as_then, state([0, 0]), DECLUMPING.as_one, 1).tolist() == [0, 1]
    clumps.forget(np.array([1]))
    assert clumps.due(as_then, state([0, 0]), later, 1).tolist() == [1]


def test_how_far_a_blob_reaches_is_by_its_mean_number_of_pixels():
    single = values([190.0], [16.0], [16.0])  # 5 % fewer by the grid
    assert not Clumps(1).due(single, state([0]), 0, 1).size
    assert Clumps(1).due(single, state([0], pixels=190.0), 0, 1).size


def test_halves_know_each_other_until_one_is_another_thing():
    clumps = Clumps(3)
    clumps.joined(0, 2)
    assert clumps.partner.tolist() == [2, -1, 0]
    clumps.forget(np.array([2]))
    assert clumps.partner.tolist() == [-1, -1, -1]


def test_a_blob_was_two_as_far_back_as_it_was_larger_or_longer_than_one():
    pixels = np.array([100.0] * 6 + [104.0, 130.0, 160.0, 180.0])
    xx = np.array([8.0] * 6 + [10.0, 12.0, 14.0, 16.0])
    own = values(pixels, xx, np.full(10, 8.0))
    assert first_of_both(own, 100.0) == 6  # 10 to 8 is longer than one disc
    assert first_of_both(own[:, 6:], 100.0) == 0
    own[:, 2:4] = np.nan  # what was not measured is no doubt
    assert first_of_both(own, 100.0) == 6


def test_the_looks_are_those_of_discs():
    looks = looks_of(PAIR)
    assert looks.pixels == pytest.approx([np.pi * 36] * 2)
    assert looks.contrast == pytest.approx(np.array([150.0, 140.0]) * (36 + 0.25 + 1 / 12) / 36)
    assert looks.width == pytest.approx([12, 12])


def overlapping(n, least=9.0):
    """Two balls of radius 8 px that overlap all the time, their middles `least` px apart once."""
    t = np.arange(n)
    apart = 14 + (least - 14) * np.exp(-(((t - n / 2) / 5) ** 2))
    x, y = 70 + 1.2 * t, 70 + 12 * np.cos(t / 9)
    step = np.stack([np.cos(0.5 + t / 40), np.sin(0.5 + t / 40)], -1) * apart[:, None] / 2
    return np.stack([np.stack([x, y], -1) - step, np.stack([x, y], -1) + step], 1)


@pytest.mark.parametrize("targets", [2, 1])
def test_balls_that_overlap_from_the_beginning_to_the_end_are_followed_as_two(targets):
    """Where one target is asked for as well: what it is, and another track."""
    path = overlapping(24)
    done = track(*recorded(path, radius=8.0), targets=targets)
    own, every = done.centroids[done.centroids["Xf"].notna()], done.tracklets
    for table, least in ((own, 0.8 * targets), (every, 1.6)):
        at = table[["Xf", "Yf"]].to_numpy()
        off = np.linalg.norm(path[table["frame"].to_numpy()] - at[:, None], axis=-1).min(axis=1)
        assert len(table) > least * len(path)
        assert off.max() < 0.15
    assert (every["frame"] == 0).sum() == 2  # followed backwards


def test_those_that_overlap_by_most_of_a_diameter_are_not_measured_and_keep_their_courses():
    path = overlapping(30, least=4.5)
    table = track(*recorded(path, radius=8.0), targets=2).centroids
    at = table[["Xf", "Yf"]].to_numpy().reshape(-1, 2, 2)
    seen = np.isfinite(at).all(axis=(1, 2))
    assert not seen[14:17].any()
    assert seen[22:].all()
    off = np.linalg.norm(at[:, :, None] - path[:, None], axis=-1)  # (samples, targets, balls)
    which = off[seen].argmin(axis=2)
    assert (which == which[0]).all()
    assert off[seen].min(axis=2).max() < 0.2


def test_a_target_seen_alone_stays_what_it_was_and_is_not_measured_while_a_thing_covers_a_part():
    path = overlapping(24)
    path[:12, 1] = path[20:, 1] = -100.0
    path[12:20, 1] = path[12:20, 0] + (4.0, 3.0)
    table = track(*recorded(path, radius=8.0), targets=1).centroids
    off = np.linalg.norm(table[["Xf", "Yf"]].to_numpy() - path[:, 0], axis=1)
    assert np.isnan(off[12:20]).all()
    assert off[[*range(12), *range(20, 24)]].max() < 0.05


@pytest.mark.parametrize("others", [(0.6,), (0.3, 0.3 + np.pi / 3)])  # rad, where they touch it
def test_a_target_found_again_after_long_is_not_the_blob_that_hid_it(others):
    """Two, by their shape; three side by side are as round as one, and as large as what was there all the time."""
    path = np.concatenate([overlapping(24), np.full((24, len(others) - 1, 2), -100.0)], axis=1)
    path[:12, 1] = -100.0
    for k, angle in enumerate(others, start=1):
        path[12:, k] = path[12:, 0] + 4.0 * np.array([np.cos(angle), np.sin(angle)])
    table = track(*recorded(path, radius=4.0), targets=1).centroids
    assert table["Xf"].notna().tolist() == [True] * 12 + [False] * 12
    assert table["flag"][12:].str.contains("merged|lost").all()


def test_three_side_by_side_from_the_beginning_are_not_measured_as_one():
    """As round as one ball; nothing but the outline shows that they are three."""
    path = overlapping(16)[:, [0, 0, 0]] + 6.0 * np.array([[0, 0], [0.83, 0.56], [-0.1, 1.0]])
    table = track(*recorded(path, radius=4.0), targets=1).centroids
    assert table["Xf"].isna().all()
    assert table["flag"].str.contains("merged").all()
