"""Lines as path data: no peak is lost, and nothing is joined over a gap."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.figures.svg_paths import UNIT, moves, stretches, thinned


@given(st.integers(0, 2**32 - 1), st.integers(2, 5000))
def test_a_thinned_line_keeps_the_least_and_the_most_of_every_column_of_pixels(seed, n):
    rng = np.random.default_rng(seed)
    x, y = np.sort(rng.uniform(0, 50, n)), rng.normal(0, 100, n)
    X, Y = thinned(x, y)
    whole = np.rint(UNIT * x), np.rint(UNIT * y)
    for column in np.unique(np.floor(whole[0] / UNIT)):
        own, kept = (b[np.floor(a / UNIT) == column] for a, b in (whole, (X, Y)))
        assert (own.min(), own.max()) == (kept.min(), kept.max())
    assert len(X) <= n
    assert (X[0], Y[0], X[-1], Y[-1]) == (whole[0][0], whole[1][0], whole[0][-1], whole[1][-1])


def test_stretches_end_where_any_column_is_missing():
    x, y = np.array([0, 1, np.nan, 3, 4]), np.array([0, 1, 2, np.nan, 4.0])
    assert [part[0].tolist() for part in stretches(x, y)] == [[0, 1], [4]]


def test_a_path_moves_from_point_to_point_and_a_point_alone_is_a_dot():
    assert moves(np.array([10.0, 13, 13, 9]), np.array([5.0, 5, 5, 2])) == "M10 5l3 0-4-3"
    assert moves(np.array([10.0]), np.array([5.0])) == "M10 5h0"
