"""Groups that lines of sight leave apart are joined by the motion, the clearest first."""

import numpy as np
import pytest

from tests.association.swarm import as_tracklets, seen, swarm
from tests.association.test_groups import partition
from vidtrack.association.bridging import Bridges
from vidtrack.association.courses import rows_of
from vidtrack.association.groups import Groups, nodes_of
from vidtrack.simulate.rig import thesis_rig


def bridges(gap):
    """Four targets that two cameras follow, with a gap in which neither sees anything."""
    rng = np.random.default_rng(1)
    cameras = thesis_rig(2)
    tracks, orders = seen(cameras, swarm(4, rng), rng)
    for track in tracks:
        track[:, 80 : 80 + gap] = np.nan
    pieces, of = zip(*map(as_tracklets, tracks), strict=True)
    nodes = nodes_of(pieces)
    g = Groups(nodes, 2)
    owner = np.concatenate([o[k] for o, k in zip(orders, of, strict=True)])
    for k in range(4):  # joined over cameras before and after the gap
        for early in (True, False):
            own = [i for i in np.flatnonzero(owner == k) if (nodes.last[i] < 100) == early]
            g.join(*own)
    return Bridges(cameras, rows_of(pieces, nodes.begin, 0.05), g), owner


@pytest.mark.parametrize("gap", [4, 10])
def test_courses_are_joined_over_a_gap_by_their_motion(gap):
    b, owner = bridges(gap)
    b.learn()
    b.join_the_clear()
    assert sorted(sorted({int(owner[n]) for n in m}) for m in partition(b.groups)) == [[k] for k in range(4)]


def test_what_is_too_far_off_in_a_picture_is_not_even_judged():
    b, owner = bridges(4)
    wrong = [
        (g, h)
        for g in b.groups.members
        for h in b.groups.members
        if g < h and owner[g] != owner[h] and b.groups.span[g] != b.groups.span[h]
    ]
    assert sum(not b._reachable(g, h) for g, h in wrong) >= len(wrong) // 2
    right = [(g, h) for g in b.groups.members for h in b.groups.members if g < h and owner[g] == owner[h]]
    assert all(b._reachable(g, h) for g, h in right)


def test_a_join_is_worth_what_lines_of_sight_and_motion_give_the_first_time_and_the_second():
    b, _ = bridges(4)
    b.learn()
    first, again = b.worths(), b.worths()
    assert first
    assert first == again
    for pair, worth in first.items():
        assert (worth.sights, worth.n) == b.groups.sights(*pair)
        assert worth.motion == b.known[b._local(pair)[0]]
