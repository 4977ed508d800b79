"""Jumps of velocity are found where they are, and a smooth motion has none."""

import numpy as np

from vidtrack.motion.impacts import SIDE, _slopes, velocity_jumps

T = np.arange(240) / 60


def jumps(y, noise, seed=0):
    y = y + np.random.default_rng(seed).normal(0, noise, T.size)
    return velocity_jumps(T, y, np.full(T.size, noise**-2.0))


def test_a_bounce_is_found_to_the_sample():
    bounce = np.abs(3 * (T - 2.008))
    size = jumps(bounce, 0.003)
    assert abs(int(np.argmax(size)) - np.searchsorted(T, 2.008)) <= 1
    assert size.max() > 20
    assert (size > 15).sum() == 1


def test_the_slopes_beside_a_sample_are_those_of_least_squares():
    rng = np.random.default_rng(4)
    t, y, w = T + rng.uniform(0, 0.005, T.size), rng.normal(0, 1, T.size), rng.uniform(0.3, 2, T.size)
    w[[20, 24]] = 0  # outliers
    first, when = np.arange(12, 40), t[12:40] - 0.01
    slope, variance = _slopes(t, y, w, first, when)
    for k, row in enumerate(first):
        rows = slice(row, row + SIDE)
        powers = np.vander(t[rows] - when[k], 3, increasing=True) * w[rows, None]
        wanted = np.linalg.lstsq(powers, y[rows] * w[rows], rcond=None)[0][1]
        np.testing.assert_allclose(slope[k], wanted, rtol=1e-8, atol=1e-8 * variance[k] ** 0.5)
        np.testing.assert_allclose(variance[k], np.linalg.inv(powers.T @ powers)[1, 1], rtol=1e-8)


def test_a_swing_and_pure_noise_jump_nowhere():
    assert jumps(np.sin(2 * np.pi * 0.9 * T), 0.003).max() < 8
    assert jumps(0 * T, 0.003).max() < 8


def test_a_record_too_short_to_have_both_sides_has_none():
    assert not velocity_jumps(T[: 2 * SIDE - 1], T[: 2 * SIDE - 1], np.ones(2 * SIDE - 1)).any()


def test_a_record_without_any_noise_is_not_split():
    assert not velocity_jumps(T, 2 * T, np.ones(T.size)).any()
