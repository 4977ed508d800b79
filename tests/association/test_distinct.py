"""Distinct pairs of numbers, by sorting in linear time."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.association import distinct
from vidtrack.association.distinct import distinct_pairs, short


@given(st.lists(st.tuples(st.integers(0, 5), st.sampled_from([0, 1, 255, 256, 65535, 65536, 1 << 40])), max_size=30))
def test_distinct_pairs_are_those_of_sorted_tuples(rows):
    a, b = (np.array([r[i] for r in rows], np.intp) for i in (0, 1))
    low, high, pair, n = distinct_pairs(a, b)
    several = sorted(set(rows))
    assert list(zip(low.tolist(), high.tolist(), strict=True)) == several
    assert pair.tolist() == [several.index(r) for r in rows]
    assert n.tolist() == [rows.count(r) for r in several]


def test_a_table_of_all_pairs_and_sorting_give_the_same(monkeypatch):
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 20, (2, 500))
    table = distinct_pairs(a, b)
    monkeypatch.setattr(distinct, "FULL", 0)
    for one, other in zip(table, distinct_pairs(a, b), strict=True):
        assert np.array_equal(one, other)


def test_short_numbers_take_two_bytes_as_far_as_they_go():
    assert short(np.array([0, 65535])).itemsize == 2
    assert short(np.array([0, 65536])).tolist() == [0, 65536]
