"""Splines on one piece agree with SciPy's, and their variances with what repeated noise does."""

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from vidtrack.motion import spline_basis
from vidtrack.motion.spline_basis import Basis, _Sums, basis_of, forget

T = np.arange(60) / 30


def test_coefficients_are_those_of_least_squares():
    y, weight = np.sin(3 * T), 1 + T
    basis = Basis(T, 0.4, 5)
    known = make_lsq_spline(T, y, basis.knots, 5, w=np.sqrt(weight))
    np.testing.assert_allclose(basis.coefficients(y, weight), known.c, atol=1e-8)
    fit = basis.fit(np.arange(60), y, weight)
    for derivative in range(3):
        np.testing.assert_allclose(fit.state[:, derivative], known.derivative(derivative)(T), atol=1e-5)


def test_variances_are_those_of_repeated_noise():
    rng, basis = np.random.default_rng(1), Basis(T, 0.5, 5)
    fits = [basis.fit(np.arange(60), rng.normal(0, 1, 60), np.ones(60)) for _ in range(400)]
    spread = np.var([fit.state for fit in fits], 0)
    np.testing.assert_allclose(spread[5:-5].mean(0), fits[0].variance[5:-5].mean(0), rtol=0.1)


def test_a_piece_whose_samples_do_not_hold_the_spline_is_refused():
    weight = np.zeros(60)
    weight[:6] = 1
    assert Basis(T, 0.2, 7).coefficients(T, weight) is None
    with pytest.raises(ValueError, match="cannot hold"):
        Basis(T, 0.2, 7).fit(np.arange(60), T, weight)


@pytest.mark.parametrize("intervals", [2, 21])
def test_sums_side_by_side_are_those_of_one_interval_after_another_to_the_bit(intervals):
    rng = np.random.default_rng(intervals)
    first = np.sort(rng.permutation(np.repeat(np.arange(intervals), 40))[: 39 * intervals])
    values, weight = rng.normal(0, 1, (len(first), 8)), rng.uniform(0, 1, len(first))
    beside = _Sums(first, intervals, values)
    last = intervals + 2 * len(first)
    one_by_one = _Sums(np.append(first, last), last + 1, np.vstack([values, values[:1]]))
    assert beside._place is not None
    assert one_by_one._place is None  # a last interval far off would fill the table
    pairs = zip(beside.of_pairs(weight), one_by_one.of_pairs(np.append(weight, 0.0)), strict=True)
    for sums, known in pairs:
        np.testing.assert_array_equal(sums, known[:, :intervals])


def test_covariances_that_are_taken_out_in_parts_are_the_same(monkeypatch):
    basis, y, rows = Basis(T, 0.3, 7), np.cos(T), np.arange(60)
    whole = basis.fit(rows, y, 1 + T)
    monkeypatch.setattr(spline_basis, "AT_ONCE", 7)
    parts = basis.fit(rows, y, 1 + T)
    np.testing.assert_array_equal(parts.state, whole.state)
    np.testing.assert_array_equal(parts.variance, whole.variance)


def test_plans_that_amount_to_the_same_knots_share_a_basis_and_few_are_kept(monkeypatch):
    forget()
    basis = basis_of(T, 0.4, 5)
    assert basis_of(T, 0.401, 5) is basis
    assert basis_of(T, 0.4, 4) is not basis
    monkeypatch.setattr(spline_basis, "KEPT", 120)
    monkeypatch.setattr(spline_basis, "SHORT", 60)
    assert basis_of(T, 0.4, 5) is basis
    basis_of(T, 0.2, 5)
    assert basis_of(T, 0.4, 5) is basis  # wanted since the other one was
    assert len(spline_basis._kept) == 2
    forget()
    assert basis_of(T, 0.4, 5) is not basis
