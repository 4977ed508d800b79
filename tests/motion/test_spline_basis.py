"""Splines on one piece agree with SciPy's, and their variances with what repeated noise does."""

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from vidtrack.motion.spline_basis import Basis

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
