"""Pieces of pictures are read from their table, also where there is none."""

import numpy as np

from vidtrack.location.lost_targets.kept_pieces import kept_of
from vidtrack.tracking.windows import COLUMNS


def test_a_table_without_pieces_is_read():
    assert kept_of({word: np.zeros(0) for word in COLUMNS}).grey == []


def test_a_piece_has_the_rows_and_columns_that_it_was_cut_with():
    grey = np.arange(1, 13, dtype=np.uint8).reshape(3, 4)
    plain = dict.fromkeys(
        ("time_s", "left", "top", "parity", "noise", "grown_x", "grown_y", "exposure", "lit_x", "lit_y", "lit_sd"),
        np.array([2.0]),
    )
    kept = kept_of(plain | {"lines": np.array([1]), "width": np.array([4]), "grey": np.array([grey.tobytes()], object)})
    np.testing.assert_array_equal(kept.grey[0], grey)
    assert (kept.noise, kept.grown.tolist(), kept.exposure, kept.left.tolist()) == (2.0, [2.0, 2.0], 2.0, [2])
    assert kept.lit.tolist() == [[2.0]] * 3
