"""Six elements say what nine would."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.symmetric import ELEMENTS, add_product, full, inverse, times


def random_symmetric(seed, n=7):
    a = np.random.default_rng(seed).normal(size=(n, 5, 3))
    return np.swapaxes(a, -1, -2) @ a


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_inverse_and_product_are_those_of_full_matrices(seed):
    matrices = random_symmetric(seed)
    S = np.stack([matrices[:, i, j] for i, j in ELEMENTS])
    h = np.random.default_rng(seed + 1).normal(size=(3, 7))
    assert full(S) == pytest.approx(matrices)
    assert full(inverse(S)) == pytest.approx(np.linalg.inv(matrices), rel=1e-6)
    assert times(S, h).T == pytest.approx((matrices @ h.T[..., None])[..., 0])


def test_products_add_up():
    S = np.zeros((6, 1))
    add_product(S, np.array([[1.0], [2], [3]]), np.array([[1.0], [2], [3]]))
    assert full(S)[0].tolist() == [[1, 2, 3], [2, 4, 6], [3, 6, 9]]


def test_a_singular_matrix_has_no_finite_inverse():
    assert not np.isfinite(inverse(np.array([[1.0], [1], [0], [1], [0], [0]]))).any()
