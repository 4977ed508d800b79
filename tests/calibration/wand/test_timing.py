"""A clock's shift from balls alone, and the adjustment that finds the rest of it."""

import numpy as np
import pytest

from tests.calibration.wand.waved import rigid_error, waved
from vidtrack.calibration.wand.ends import orders, stretches
from vidtrack.calibration.wand.refined import refine_wand
from vidtrack.calibration.wand.rig import find_rig
from vidtrack.calibration.wand.timing import find_shift
from vidtrack.calibration.wand.tracks import Arranged, Follows, Timed


def _follows(scene):
    return [Follows(scene.t, own, np.full(own.shape, 0.1), stretches(own)) for own in scene.b]


@pytest.mark.parametrize("late", [1.234, -0.617])
def test_the_shift_is_found_to_a_part_of_a_frame(late):
    scene = waved(21, n=400, late=[0.0, late])
    one, other = _follows(scene)
    ways = orders(scene.wand.lengths)
    found = find_shift(one.t, one.b, other.t, other.b, ways, (one.stretch, other.stretch))
    assert found is not None
    assert found.sure
    assert found.seconds == pytest.approx(late, abs=0.01)


def test_tracks_without_common_moments_give_no_shift():
    scene = waved(22, n=300)
    one, other = _follows(scene)
    none = np.full(other.b.shape, np.nan)
    assert find_shift(one.t, one.b, other.t, none, orders(scene.wand.lengths), (one.stretch, other.stretch)) is None


def test_an_unknown_clock_is_found_with_the_cameras():
    scene = waved(23, n=400, late=[0.0, 0.4321])
    ways = orders(scene.wand.lengths)
    timed = Timed(_follows(scene), ways, [1])
    b = timed.sampled(np.zeros(2)).b
    rig = find_rig(b, timed.stretch(), scene.nominal, scene.wand, [None, None], np.random.default_rng(0))
    arrange = Arranged(ways, b, rig.b)
    done = refine_wand(rig.cameras, timed.sampled, scene.wand, arrange=arrange, models=("tsai",), late=timed.late)
    assert timed.shift[1] + done.clocks[1] == pytest.approx(0.4321, abs=4 * done.clock_sd[1] + 1e-5)
    assert done.clock_sd[1] < 5e-4
    error, floor = rigid_error(done.cameras, scene.cameras, np.random.default_rng(0))
    assert error < 1.2 * floor
