"""Groups are joined while a choice is clear, and what contradicts is never one."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.association.groups import CHANCE, MARGIN, Groups, Worth, clear_pairs, nodes_of
from vidtrack.association.pairs import LOSS, Pairs
from vidtrack.association.tracklets import tracklets_of


def tracklets(*spans):
    """One camera's tracklets from first to last moment."""
    owner = np.concatenate([np.full(b - a + 1, k) for k, (a, b) in enumerate(spans)])
    sample = np.concatenate([np.arange(a, b + 1) for a, b in spans])
    return tracklets_of(owner, sample, np.zeros((len(owner), 2)), np.ones((len(owner), 2)))


def pairs(*rows):
    """Pairs from (a, b, value)."""
    a, b, value = (np.array(c) for c in zip(*rows, strict=True))
    return Pairs(a, b, np.ones_like(a), value.astype(float), np.zeros(len(a)), np.zeros(len(a)))


def groups(cameras, **between):
    out = Groups(nodes_of(cameras), len(cameras))
    for key, rows in between.items():
        out.add(int(key[1]), int(key[2]), pairs(*rows))
    return out


def partition(out):
    return sorted(sorted(m) for m in out.members.values())


def test_pieces_of_one_camera_are_chained_by_a_whole_one_of_another():
    out = groups([tracklets((0, 40), (50, 90)), tracklets((0, 90))], c01=[(0, 0, 100), (1, 0, 90)])
    out.join_the_clear()
    assert partition(out) == [[0, 1, 2]]
    assert out.span[out.root[0]] == (0, 90)
    assert out.lead[out.root[0]] == pytest.approx(90)


def test_what_fits_two_about_as_well_is_left_apart_and_what_fits_one_better_is_joined():
    two = [tracklets((0, 90)), tracklets((0, 90), (0, 90))]
    least = MARGIN + CHANCE  # of n = 1 miss in each of two pairs
    close = groups(two, c01=[(0, 0, 100), (0, 1, 100.1 - least)])
    close.join_the_clear()
    assert partition(close) == [[0], [1], [2]]
    clear = groups(two, c01=[(0, 0, 100), (0, 1, 99.9 - least)])
    clear.join_the_clear()
    assert partition(clear) == [[0, 1], [2]]
    assert clear.lead[clear.root[0]] == pytest.approx(MARGIN + 0.1)


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


def test_two_tracklets_of_one_camera_at_one_moment_are_never_one_target():
    out = groups([tracklets((0, 50), (50, 90)), tracklets((0, 90))], c01=[(0, 0, 100), (1, 0, 50)])
    assert out.value(0, 2) == 100
    out.join_the_clear()
    assert out.value(out.root[0], 1) == -np.inf
    assert partition(out) == [[0, 2], [1]]


def test_tracklets_that_overlap_without_fitting_contradict_but_for_a_moment_or_two():
    out = groups([tracklets((0, 50)), tracklets((49, 90), (40, 90))], c01=[(0, 0, -1.0)])
    out.pair.clear()
    assert out.value(0, 1) == -2 * LOSS
    assert out.value(0, 2) == -np.inf


def test_a_third_camera_undoes_a_coincidence():
    cameras = [tracklets((0, 90)), tracklets((0, 90), (0, 90)), tracklets((0, 90))]
    out = groups(cameras, c01=[(0, 0, 95), (0, 1, 100)], c02=[(0, 0, 100)], c12=[(0, 0, 100)])
    out.join_the_clear()
    assert [0, 1, 3] in partition(out)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.floats(-50, 200)), min_size=1, max_size=16))
def test_a_group_never_holds_two_tracklets_of_a_camera_at_one_moment(rows):
    spans = [(0, 30), (20, 60), (40, 90), (0, 90)]
    rows = list({(a, b): (a, b, v) for a, b, v in rows}.values())
    out = groups([tracklets(*spans), tracklets(*spans)], c01=rows)
    out.join_the_clear()
    for own in out.spans.values():
        for camera in own:
            assert all(a[1] < b[0] for a, b in pairwise(camera))
    assert sorted(n for m in out.members.values() for n in m) == list(range(8))
