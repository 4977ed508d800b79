"""A pair is clear where no other way comes near it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.association.test_groups import groups, tracklets
from vidtrack.association.choices import Choices, Worth
from vidtrack.association.groups import MARGIN


def choices(g, worth, margin):
    """What is clear among pairs of such worths."""
    partners = {k: {} for k in g.members}
    for (a, b), w in worth.items():
        partners[a][b] = partners[b][a] = w
    return Choices(partners.__getitem__, lambda a, b: g.value(a, b) < 0, margin)


def clear_pairs(g, worth, margin):
    return choices(g, worth, margin).clear(worth)


def test_of_two_pairings_the_likelier_is_clear_by_the_difference_of_their_sums():
    g = groups([tracklets((0, 9), (0, 9), (20, 29), (20, 29))])
    worth = {p: Worth(0.0, 10 + w, 0) for p, w in {(0, 2): 5.0, (1, 3): 5.0, (0, 3): 1.0, (1, 2): 0.5}.items()}
    assert clear_pairs(g, worth, 8.0) == [(pytest.approx(8.5), (1, 3), 2), (pytest.approx(8.5), (0, 2), 3)]
    assert clear_pairs(g, worth, 8.6) == []


def test_what_noise_makes_of_two_pairings_that_both_fit_is_no_evidence():
    g = groups([tracklets((0, 9), (0, 9)), tracklets((0, 9), (0, 9))])
    alike = {(0, 2): 500.0, (1, 3): 500.0, (0, 3): 480.0, (1, 2): 480.0}
    assert clear_pairs(g, {p: Worth(w, 0.0, 200) for p, w in alike.items()}, MARGIN) == []
    told = {p: Worth(w, m, 200) for (p, w), m in zip(alike.items(), (0.0, 0.0, -9.0, 0.0), strict=True)}
    assert [p for _, p, _ in clear_pairs(g, told, MARGIN)] == [(1, 3), (0, 2)]


def test_what_can_be_joined_one_after_the_other_is_no_rival():
    g = groups([tracklets((0, 9), (20, 29), (40, 49))])
    worth = {(0, 1): Worth(0.0, 9.0, 0), (0, 2): Worth(0.0, 8.5, 0)}
    assert {p for _, p, _ in clear_pairs(g, worth, MARGIN)} == {(0, 1), (0, 2)}


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7), st.integers(-5, 60)), max_size=24), st.integers(0, 9))
def test_the_clear_pairs_apart_are_those_that_a_greedy_walk_over_all_clear_ones_takes(rows, margin):
    spans = [(0, 30), (20, 60), (40, 90), (0, 90)]
    g = groups([tracklets(*spans), tracklets(*spans)])
    worth = {(a, b): Worth(float(v), 0.0, 1) for a, b, v in rows if a < b and v > 0}
    touched, walked = set(), []
    for one in clear_pairs(g, worth, margin):
        if touched.isdisjoint(one.pair):
            touched.update(one.pair)
            walked.append(one)
    assert choices(g, worth, margin).clear_apart(worth) == walked
