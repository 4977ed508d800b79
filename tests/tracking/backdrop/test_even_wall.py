"""A wall with a pattern is made even about a target: what shows of it through a soft rim is taken off."""

import cv2
import numpy as np
import pytest

from tests.discs import disc
from vidtrack.tracking.backdrop.even_wall import even_wall

SIDE, LEVEL, TARGET, RADIUS = 48, 70.0, 190.0, 6.0
NONE = np.zeros((SIDE, SIDE), bool)


def rough(seed, sd=12.0, grain=3.0):
    grey = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, (SIDE, SIDE)).astype(np.float32), (0, 0), grain)
    return LEVEL + (grey - grey.mean()) / grey.std() * np.float32(sd)


def cover_of(x, y, blur=1.5):
    return cv2.GaussianBlur(disc((SIDE, SIDE), x, y, RADIUS), (0, 0), blur).astype(np.float32)


def window(wall, cover, seed=0, noise=1.0):
    grain = np.random.default_rng(seed).normal(0, noise, wall.shape)
    return (cover * TARGET + (1 - cover) * wall + grain).astype(np.float32)


def middle(grey):
    """x, y px of the light above the median of what is far from the middle."""
    y, x = np.mgrid[:SIDE, :SIDE]
    near = np.hypot(x - 23.6, y - 24.2) < RADIUS + 6
    over = (grey - np.median(grey[~near])) * near
    return np.array([(over * x).sum(), (over * y).sum()]) / over.sum()


@pytest.mark.parametrize("grain", [0.6, 2.0, 5.0])
def test_what_shows_through_the_rim_is_taken_off(grain):
    before, after = [], []
    for seed in range(12):
        wall, cover = rough(seed, grain=grain), cover_of(23.6, 24.2)
        even, unknown = even_wall(window(wall, cover, seed), wall, NONE, 115.0, 1.0)
        assert unknown == 0
        before.append(middle(window(wall, cover, seed)) - (23.6, 24.2))
        after.append(middle(even) - (23.6, 24.2))
    assert np.std(after) < 0.35 * np.std(before)


def test_a_column_computed_by_hand():
    wall = np.full((SIDE, SIDE), LEVEL, np.float32)
    wall[:, ::2] += 20  # stripes of 90 and 70: the median is that of either
    cover = np.zeros((SIDE, SIDE), np.float32)
    cover[18:30, 18:30], cover[18:30, 30] = 1, 0.5  # its rim is half covered, over a stripe of 90
    even, unknown = even_wall(window(wall, cover, noise=0.0), wall, NONE, TARGET - 80, 1.0)
    base = np.median(wall)
    assert unknown == 0
    assert even[20:28, 20:28] == pytest.approx(TARGET)
    assert even[24, 30] == pytest.approx(0.5 * TARGET + 0.5 * base)
    assert even[:10] == pytest.approx(np.full((10, SIDE), base), abs=1e-3)


def test_light_on_the_wall_that_changed_alike_is_of_no_account():
    wall, cover = rough(1), cover_of(23.6, 24.2)
    one, _ = even_wall(window(wall, cover), wall, NONE, 115.0, 1.0)
    other, _ = even_wall(window(wall, cover), wall - 9, NONE, 115.0, 1.0)
    np.testing.assert_allclose(one, other, atol=0.01)


def test_a_piece_of_the_wall_is_no_target():
    cover = cover_of(23.6, 24.2)
    wall = rough(2) + 70 * cover  # a bright patch
    even, _ = even_wall(window(wall, 0 * cover), wall, NONE, 115.0, 1.0)
    assert even.std() < 2.5


@pytest.mark.parametrize(
    "wall",
    [
        pytest.param(np.full((SIDE, SIDE), LEVEL, np.float32), id="plain"),
        pytest.param(rough(8), id="another one"),
        pytest.param(np.roll(rough(3), 6, axis=1), id="moved"),
    ],
)
def test_where_the_pattern_is_not_what_the_window_shows_nothing_is_changed(wall):
    even, unknown = even_wall(window(rough(3), cover_of(23.6, 24.2)), wall, NONE, 115.0, 1.0)
    assert even is None
    assert unknown == (wall.std() > 0)


def test_what_was_never_seen_stays_and_is_said():
    wall, cover = rough(4), cover_of(23.6, 24.2)
    hidden = NONE.copy()
    hidden[:, :17] = True  # a part of the rim
    even, unknown = even_wall(window(wall, cover), np.where(hidden, 0, wall), hidden, 115.0, 1.0)
    assert 0.05 < unknown < 0.4
    np.testing.assert_array_equal(even[:, :17], window(wall, cover)[:, :17])
    hidden[:, :26] = True
    assert even_wall(window(wall, cover), wall, hidden, 115.0, 1.0)[0] is None
    assert even_wall(window(wall, cover), wall, ~NONE, 115.0, 1.0) == (None, 1.0)


def test_what_is_left_of_a_wall_that_moved_a_little_is_not_known():
    wall, cover = rough(5, grain=4.0), cover_of(23.6, 24.2)
    even, unknown = even_wall(window(np.roll(wall, 2, axis=1), cover), wall, NONE, 115.0, 1.0)
    assert even is not None
    apart = np.roll(wall, 2, axis=1) - wall
    assert unknown == pytest.approx(apart.var() / wall.var(), rel=0.5)
    assert even_wall(window(wall, cover), wall, NONE, 115.0, 1.0)[1] == 0
