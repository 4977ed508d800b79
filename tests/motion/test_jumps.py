"""Where a target is elsewhere from one sample to the next."""

import numpy as np
import pytest

from vidtrack.motion.jumps import jumps

T = np.arange(120) / 30
SIGMA = np.full((120, 3), 0.01)


def swing(t, hz=0.8):
    return np.stack([10 * np.sin(2 * np.pi * hz * t), 0.4 * np.cos(2 * np.pi * 1.3 * t), 0.2 * t], -1)


def test_a_part_that_was_cut_out_of_all_recordings_is_a_jump():
    p = np.concatenate([swing(T)[:60], swing(T + 0.5)[60:]])
    (jump,) = jumps(T, p, SIGMA)
    assert jump.time_s == pytest.approx(2.0)
    assert jump.length == pytest.approx(np.linalg.norm(p[60] - p[59]))
    assert jump.usual < jump.length / 2


@pytest.mark.parametrize("hz", [0.3, 2.0, 7.0, 14.0])
def test_a_swing_of_any_rate_has_none(hz):
    assert jumps(T, swing(T, hz) + np.random.default_rng(2).normal(0, 0.01, (120, 3)), SIGMA) == []


def test_an_impact_a_release_and_a_single_sample_that_is_off_are_none():
    bounce = np.stack([np.abs(8 * np.sin(3 * T)), 0 * T, T], -1)
    assert jumps(T, bounce, SIGMA) == []
    struck = np.where(T[:, None] < 2, T[:, None] * 0.5, 1 + (T[:, None] - 2) * 60) * np.array([1.0, 0.2, 0.0])
    assert jumps(T, struck, SIGMA) == []
    off = swing(T)
    off[50] += 6
    assert jumps(T, off, SIGMA) == []


def test_what_rests_may_be_moved_by_hand():
    p = np.where(T[:, None] < 2, 0.0, 5.0) + np.random.default_rng(4).normal(0, 0.003, (120, 3))
    assert jumps(T, p, SIGMA) == []


def test_time_stamps_that_say_so_and_missing_samples_are_no_jump():
    t = np.where(np.arange(120) < 60, T, T + 0.5)
    assert jumps(t, swing(t), SIGMA) == []
    p = swing(T)
    p[55:75] = np.nan
    assert jumps(T, p, SIGMA) == []
    assert jumps(T[:5], p[:5], SIGMA[:5]) == []
