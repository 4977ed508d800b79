"""What one disc explains is found out once, and soon."""

import numpy as np
import pytest

from tests.discs import disc
from vidtrack.tracking.discs import clump as module
from vidtrack.tracking.discs.clump import clump_at

MIDDLE = 25.3


def window(*at, radius=8.0, noise=2.0):
    rest = np.ones((50, 50))
    for x, y in at:
        rest = rest * (1 - disc((50, 50), x, y, radius))
    return (30 + 150 * (1 - rest) + np.random.default_rng(3).normal(0, noise, (50, 50))).astype(np.float32)


def clump(grey, hidden=None, at=MIDDLE):
    return clump_at(grey, np.zeros(grey.shape, bool) if hidden is None else hidden, at, at, 150.0, 2.0)


def test_one_disc_explains_a_disc_and_not_two():
    assert clump(window((MIDDLE, MIDDLE))).one_leaves == 0
    assert clump(window((MIDDLE - 5, MIDDLE), (MIDDLE + 5, MIDDLE))).one_leaves > 10


def test_a_fit_that_explains_a_disc_ends_before_it_has_settled(monkeypatch):
    seen = clump(window((MIDDLE, MIDDLE)))
    scenes = []
    real = module.fit_together.__globals__["_scene"]
    monkeypatch.setitem(module.fit_together.__globals__, "_scene", lambda *a: scenes.append(1) or real(*a))
    assert seen.one_leaves == 0
    soon = len(scenes)
    x, y = seen.middle[:1], seen.middle[1:]
    seen.fitted(seen.about(x, y, np.full((2, 1), 8.0)), x, y, np.log(np.full((2, 1), 8.0)))
    assert soon < len(scenes) - soon
    assert (seen.one_leaves, len(scenes)) == (0, len(scenes))


def test_the_blob_is_that_about_the_place_with_its_moments():
    seen = clump(window((MIDDLE, MIDDLE)))
    assert seen.middle == pytest.approx([MIDDLE, MIDDLE], abs=0.1)
    assert seen.moments[:2] == pytest.approx([16, 16], rel=0.05)
    assert seen.long < 0.03
    assert len(seen.pixels) == pytest.approx(np.pi * 64, rel=0.05)


def test_nothing_small_things_and_what_reaches_the_edge_are_no_clumps():
    grey = window((MIDDLE, MIDDLE))
    assert clump(grey, np.ones(grey.shape, bool)) is None
    assert clump(window((MIDDLE, MIDDLE), radius=3.0)) is None
    assert clump(window((4.0, 4.0)), at=4.0) is None
