"""A blob of three discs is distinguished from one, from two and from things that are no discs."""

import numpy as np
import pytest

from vidtrack.tracking.discs.clump import clump_at
from vidtrack.tracking.discs.three_discs import reaching, three_discs

SHAPE = (90, 90)


def window(at, radius=8.0, lines=1, seed=0):
    """Opaque discs with soft edges over a background of 30, with noise of 2; every `lines`th row."""
    y, x = np.mgrid[: SHAPE[0] : lines, : SHAPE[1]]
    share = np.zeros(x.shape)
    for a, b in at:
        share = np.maximum(share, np.clip(radius + 0.5 - np.hypot(x - a, y - b), 0, 1))
    return (30 + 150 * share + np.random.default_rng(seed).normal(0, 2, x.shape)).astype(np.float32)


def found(grey, lines=1):
    clump = clump_at(grey, np.zeros(grey.shape, bool), 45.0, 45.0 / lines, 150.0, 2.0, lines)
    return clump and three_discs(clump)


def round_about(spacing, radius=8.0, n=3, turned=0.3):
    way = np.exp(1j * (turned + 2 * np.pi * np.arange(n) / n)) * spacing * radius / np.sqrt(3)
    return np.stack([45 + way.real, 45 + way.imag], -1)


@pytest.mark.parametrize(("spacing", "radius"), [(1.0, 8.0), (1.6, 8.0), (1.3, 5.0)])
def test_three_side_by_side_are_three_discs_of_their_size(spacing, radius):
    assert found(window(round_about(spacing, radius), radius)) == pytest.approx(np.pi * radius**2, rel=0.06)


def test_three_in_a_row_and_three_in_fields_are_three():
    row = np.array([[33.0, 41.0], [45.0, 45.0], [57.0, 49.0]])
    assert found(window(row)) == pytest.approx(np.pi * 64, rel=0.06)
    assert found(window(round_about(1.5), lines=2), 2) == pytest.approx(np.pi * 64 / 2, rel=0.1)


def test_one_two_a_square_and_a_cross_are_not():
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] - 45.0
    square = (30 + 150.0 * ((np.abs(x) < 9) & (np.abs(y) < 9))).astype(np.float32)
    cross = 30 + 150.0 * ((np.minimum(np.abs(x), np.abs(y)) < 3) & (np.maximum(np.abs(x), np.abs(y)) < 12))
    for grey in (window([[45.0, 45.0]]), window([[41.0, 45.0], [49.0, 46.0]]), square, cross.astype(np.float32)):
        assert found(grey) is None


def test_what_reaches_farther_than_a_disc_is_looked_at():
    """A disc of radius r has xx + yy = r^2 / 2."""
    pixels = np.pi * 64
    assert reaching(*np.array([[pixels], [16.0], [16.0]])).tolist() == [False]
    assert reaching(*np.array([[pixels], [16.3], [16.3]])).tolist() == [True]
    assert reaching(*np.array([[50.0], [4.05], [4.05]])).tolist() == [False]  # the grid makes that
    assert reaching(*np.array([[80.0, 100.0], [7.0, 8.7], [7.0, 8.7]])).tolist() == [False, True]  # lobes need pixels
