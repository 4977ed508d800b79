"""Groups are joined while a choice is clear, and what contradicts is never one."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.association.choices import CHANCE
from vidtrack.association.groups import MARGIN, Groups, nodes_of
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
def test_what_is_remembered_of_partners_is_what_a_fresh_look_finds(rows):
    spans = [(0, 30), (20, 60), (40, 90), (0, 90)]
    rows = list({(a, b): (a, b, v) for a, b, v in rows}.values())
    out = groups([tracklets(*spans), tracklets(*spans)], c01=rows)
    out.join_the_clear()
    for g, members in out.members.items():
        positive = {(a, 4 + b) for a, b, v in rows if v > 0}
        fits = {b for a in members for b in range(8) if (min(a, b), max(a, b)) in positive}
        assert out.kin[g] == {out.root[b] for b in fits} - {g}
        fresh = {h: out._summed(g, h)[0] for h in out.members if h != g}
        assert set(out.partners(g)) == {h for h, value in fresh.items() if value > 0}
        assert all(out.value(g, h) == pytest.approx(value) for h, value in fresh.items())


@given(
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.floats(-50, 200)), min_size=1, max_size=16),
    st.lists(st.sampled_from(["", "", "float", "buoy"]), min_size=8, max_size=8),
    st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=4),
)
def test_what_a_union_is_worth_is_what_its_parts_are_and_a_name_counts_once(rows, names, asked):
    spans = [(0, 10), (12, 30), (29, 60), (70, 90)]
    nodes = nodes_of([tracklets(*spans), tracklets(*spans)], [names[:4], names[4:]])
    out = Groups(nodes, 2)
    out.add(0, 1, pairs(*{(a, b): (a, b, v) for a, b, v in rows}.values()))
    for a, b in asked:
        for g in out.members:  # what is known of each before it grows
            assert all(out.value(g, h) < np.inf for h in out.members if h != g)
        g, h = out.root[a], out.root[b]
        if g != h and out.value(g, h) > -np.inf:
            out.join(g, h)
    for g in out.members:
        for h in out.members:
            assert g == h or out.value(g, h) == pytest.approx(out._summed(g, h)[0])


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
