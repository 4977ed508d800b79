"""Intervals of least-squares parameters, against the scatter of many trials."""

import numpy as np
import pytest

from vidtrack.analysis.interval import parameter_covariance, t_factor


def scatter_and_stated(rng, noise_of, n=300, trials=300):
    t = np.linspace(0, 1, n)
    J = np.column_stack([np.ones(n), t])
    found, stated = [], []
    for _ in range(trials):
        y = J @ [1.0, 2.0] + noise_of(rng, n)
        p, *_ = np.linalg.lstsq(J, y, rcond=None)
        found.append(p)
        stated.append(np.sqrt(np.diag(parameter_covariance(J, y - J @ p))))
    return np.std(found, axis=0), np.mean(stated, axis=0)


def test_white_noise_gives_the_textbook_error():
    scatter, stated = scatter_and_stated(np.random.default_rng(0), lambda rng, n: rng.normal(0, 1, n))
    assert stated == pytest.approx(scatter, rel=0.2)


def test_noise_that_lasts_over_ten_samples_is_not_taken_for_white():
    def lasting(rng, n):
        return np.convolve(rng.normal(0, 1, n + 9), np.ones(10) / 10, "valid")

    scatter, stated = scatter_and_stated(np.random.default_rng(1), lasting)
    assert (stated > 0.75 * scatter).all()
    white = 1 / np.sqrt(10) * np.sqrt(4 / 300)  # of the intercept, were the noise white
    assert stated[0] > 2 * white


def test_the_factor_is_that_of_student():
    assert [t_factor(1), t_factor(10), t_factor(1e6)] == pytest.approx([12.706, 2.228, 1.96], abs=1e-3)
