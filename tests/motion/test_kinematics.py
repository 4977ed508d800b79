import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.motion.test_smoothing import pluck
from vidtrack.motion.kinematics import finite_differences, motion


def test_finite_differences_of_a_parabola_are_exact_on_paper():
    t = np.array([0.0, 1, 3, 4])
    v, a = finite_differences(t, t[:, None] ** 2)
    assert v[1:-1, 0] == pytest.approx([2, 6])
    assert a[1:-1, 0] == pytest.approx([2, 2])
    assert np.isnan(v[[0, -1]]).all()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.01, 1), min_size=3, max_size=20), st.floats(-5, 5), st.floats(-5, 5))
def test_finite_differences_of_any_parabola_are_exact_at_any_spacing(steps, b, c):
    t = np.cumsum(steps)
    v, a = finite_differences(t, (1 + b * t + c * t * t)[:, None])
    scale = 1e-8 * (1 + abs(b) + abs(c)) * (1 + t[-1] ** 2) / min(steps) ** 2
    assert np.abs(v[1:-1, 0] - b - 2 * c * t[1:-1]).max() < scale
    assert np.abs(a[1:-1, 0] - 2 * c).max() < scale


def test_finite_differences_beside_a_missing_sample_are_missing():
    p = np.arange(7.0)[:, None]
    p[3] = np.nan
    v, _ = finite_differences(np.arange(7.0), p)
    assert np.isnan(v[2:5]).all()
    assert v[1, 0] == 1


def test_every_axis_is_smoothed_by_its_own_noise():
    t, rng = np.arange(300) / 30, np.random.default_rng(1)
    p = np.stack([pluck(t)[:, 0] + rng.normal(0, s, 300) for s in (0.01, 0.2)], -1)
    told = motion(t, np.column_stack([p, np.full(300, np.nan)]))
    assert told.noise_sd[:2] == pytest.approx([0.01, 0.2], rel=0.15)
    assert told.spacing_s[1] > told.spacing_s[0]
    assert np.isnan(told.position[:, 2]).all()
    assert np.isnan(told.noise_sd[2])


def test_the_ends_of_a_record_and_of_a_gap_are_edges():
    t = np.arange(300) / 30
    p = (pluck(t)[:, 0] + np.random.default_rng(2).normal(0, 0.02, 300))[:, None]
    p[100:120] = np.nan
    edge = motion(t, p).edge
    assert edge[[0, 99, 120, 299]].all()
    assert not edge[20:80].any()
    assert not edge[100:120].any()


def test_a_scrap_between_gaps_is_short():
    t, p = np.arange(100) / 30, np.zeros((100, 1))
    p[40:50] = p[53:60] = np.nan
    assert motion(t, p).short.tolist() == [50 <= i < 53 for i in range(100)]


def juggled(seed, noise, seconds=12.0, rate_hz=60.0):
    """Height (m) and velocity of a ball that is thrown and caught: flights of half a second, hands of a tenth."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / rate_hz)
    y, v, start = np.zeros(t.size), np.zeros(t.size), 0.0
    while start < seconds:
        flight, hand = rng.uniform(0.4, 0.7), rng.uniform(0.05, 0.15)
        v0 = 9.81 * flight / 2
        s = t - start
        fly = (s >= 0) & (s < flight)
        y[fly], v[fly] = v0 * s[fly] - 9.81 / 2 * s[fly] ** 2, v0 - 9.81 * s[fly]
        s = (s - flight) / hand
        held = (s >= 0) & (s < 1)
        y[held], v[held] = -v0 * hand * (s[held] - s[held] ** 2), -v0 * (1 - 2 * s[held])
        start += flight + hand
    return t, y + rng.normal(0, noise, t.size), y, v


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("noise", [0.001, 0.01])
def test_impacts_neither_throw_the_smoothing_off_nor_make_it_worse_than_differences(seed, noise):
    t, seen, y, v = juggled(seed, noise)
    m = motion(t, seen[:, None], np.full((t.size, 1), noise))
    found = np.isfinite(m.position[:, 0])
    assert found.all()
    assert np.abs(m.position[:, 0] - y).max() < 6 * noise
    assert 0.7 < np.mean(((m.position[:, 0] - y) / m.sigma[:, 0, 0]) ** 2) < 1.4
    sure = ~m.edge & ~m.outlier
    by_differences = np.nanstd((finite_differences(t, seen[:, None])[0][:, 0] - v)[sure])
    assert np.std((m.velocity[:, 0] - v)[sure]) < 1.1 * by_differences
    assert m.outlier.mean() < 0.01


def test_a_false_fix_is_left_out_and_runs_of_them_and_ends_are_not():
    t, seen, y, _ = juggled(0, 0.001, seconds=0.35)  # one flight
    seen[10] += 0.1
    m = motion(t, seen[:, None])
    assert np.flatnonzero(m.outlier).tolist() == [10]
    assert abs(m.position[10, 0] - y[10]) < 0.005
    seen[10] -= 0.1
    seen[-1] += 0.1
    ends = motion(t, seen[:, None])
    assert not ends.outlier.any()
    assert np.abs(ends.position[:, 0] - y).max() < 0.11


def test_a_record_of_false_fixes_alone_has_an_answer():
    rng = np.random.default_rng(4)
    y = rng.choice([0.0, 50.0, -300.0], (40, 1)) + rng.normal(0, 0.01, (40, 1))
    y[rng.random(40) < 0.3] = np.nan
    m = motion(np.arange(40) / 30, y)
    assert np.isfinite(m.position).any()
    assert np.nanmax(np.abs(m.position)) < 2000
