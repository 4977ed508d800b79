"""Pieces of pictures: the right place, never out of the picture, never too many."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.tracking.crops import KEPT, Crop, piece_of, wanted
from vidtrack.tracking.sample import Sample

ROWS, COLUMNS = 40, 60
IMAGE = np.add.outer(4 * np.arange(ROWS), np.arange(COLUMNS)).astype(np.uint8)


def test_a_piece_is_that_part_of_the_picture():
    piece = piece_of(Sample(IMAGE, 0.0), np.array([20.0, 10.0]), np.array([7.0, 5.0]), 1.0)
    assert np.array_equal(piece, IMAGE[10:15, 20:27])


@given(st.floats(-200, 200), st.floats(-200, 200), st.integers(1, 80), st.integers(1, 80))
def test_a_piece_lies_in_the_picture_and_is_as_large_as_the_box_if_the_picture_is(x, y, wide, high):
    piece = piece_of(Sample(IMAGE, 0.0), np.array([x, y]), np.array([wide, high]), 1.0)
    assert piece.shape == (min(high, ROWS), min(wide, COLUMNS))


def test_a_piece_of_a_field_has_half_the_rows():
    field = Sample(IMAGE[1::2], 0.0, parity=1, lines=2)
    piece = piece_of(field, np.array([20.0, 11.0]), np.array([6.0, 8.0]), 1.0)
    assert np.array_equal(piece, IMAGE[11:19:2, 20:26])


def test_deep_pictures_become_grey_levels():
    deep = np.full((8, 8), 600, np.uint16)
    assert (piece_of(Sample(deep, 0.0), np.zeros(2), np.full(2, 4.0), 255 / 1023) == 150).all()
    assert (piece_of(Sample(deep, 0.0), np.zeros(2), np.full(2, 4.0), 1.0) == 255).all()


def test_few_pieces_are_kept_of_each_target_and_in_all():
    crops = []
    for i in range(100):
        for target in range(10):
            if wanted(crops, target):
                crops.append(Crop(i, target, 0, IMAGE))
    assert len(crops) == KEPT.in_all
    alone = [Crop(i, 0, 0, IMAGE) for i in range(KEPT.of_each)]
    assert not wanted(alone, 0)
    assert wanted(alone[1:], 0)
    assert wanted(alone, 1)
