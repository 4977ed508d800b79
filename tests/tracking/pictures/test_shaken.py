import cv2
import numpy as np
import pytest

from vidtrack.tracking.pictures.shaken import explained

SIZE = 128, 192
SHAPE = 16, 24  # blocks of 8 px


def texture(seed=0):
    rng = np.random.default_rng(seed)
    return np.clip(cv2.GaussianBlur(rng.normal(0, 60, SIZE), (0, 0), 1.5) + 110, 16, 235).astype(np.uint8)


def edge():
    """A wall and a floor: nothing but one edge."""
    picture = np.full(SIZE, 150, np.uint8)
    picture[90:] = 40
    return picture


def noisy(picture, seed, sd=1.5):
    levels = picture + np.random.default_rng(seed).normal(0, sd, SIZE)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def shifted(picture, down, across):
    return np.roll(picture, (down, across), (0, 1))


@pytest.mark.parametrize("shift", [(0, 1), (3, -5), (-9, 12), (15, 0)])
@pytest.mark.parametrize("scene", [texture, edge])
def test_a_picture_that_is_shifted_as_a_whole_is_explained(scene, shift):
    if scene is edge and not shift[0]:
        shift = 4, 0  # along the edge nothing shows
    before, after = noisy(scene(), 1), noisy(shifted(scene(), *shift), 2)
    by_block = np.abs(after.astype(float) - before).reshape(16, 8, 24, 8).mean((1, 3))
    assert explained(before, after, 8, SHAPE)[by_block > 4].mean() > 0.97


def test_so_it_is_in_much_noise():
    before, after = noisy(edge(), 1, sd=5), noisy(shifted(edge(), 4, 0), 2, sd=5)
    assert explained(before, after, 8, SHAPE)[11].all()


def test_so_it_is_by_half_a_pixel_and_with_other_light():
    before = texture()
    half = cv2.warpAffine(before, np.array([[1, 0, 2.5], [0, 1, -1.5]]), SIZE[::-1])
    assert explained(before, half, 8, SHAPE).mean() > 0.8
    assert explained(noisy(before, 1), noisy(0.7 * shifted(before, 2, 3) + 15, 2), 8, SHAPE).mean() > 0.9


def test_what_is_not_shifted_with_the_rest_is_not_explained():
    before, after = texture(), shifted(texture(), 3, -4)
    after[40:64, 80:120] = texture(5)[40:64, 80:120]
    assert explained(before, after, 8, SHAPE)[5:8, 10:15].mean() < 0.2
    assert explained(before, after, 8, SHAPE)[9:].mean() > 0.95


@pytest.mark.parametrize("part", [0.3, 0.7])
def test_a_piece_of_a_picture_that_is_shifted_alone_explains_nothing(part):
    """As where the vectors of a damaged picture are wrong from some row on, which is no motion of the camera."""
    before = noisy(texture(), 1)
    after = noisy(texture(), 2)
    row = int(part * SIZE[0])
    after[row:] = shifted(before, 0, 8)[row:]
    assert not explained(before, after, 8, SHAPE)[: row // 8].all() or not explained(before, after, 8, SHAPE).any()


def test_nothing_is_explained_where_nothing_was_shifted_or_pictures_are_too_small():
    assert not explained(noisy(texture(), 1), noisy(texture(), 2), 8, SHAPE).any()
    assert not explained(texture(), texture(3), 8, SHAPE).any()
    small = texture()[:8, :8]
    assert not explained(small, shifted(small, 0, 1), 8, (1, 1)).any()
