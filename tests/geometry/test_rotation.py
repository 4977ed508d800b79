"""Rodrigues' formula: on paper, against scipy, for the smallest turns, and many at once as one by one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidtrack.geometry.rotation import rotation_from_vector

part = st.floats(-3, 3)


def test_a_quarter_turn_about_z_takes_x_to_y():
    np.testing.assert_allclose(rotation_from_vector([0, 0, np.pi / 2]) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_small_rotations_keep_their_precision():
    np.testing.assert_allclose(rotation_from_vector([1e-9, 0, 0])[2, 1], 1e-9, rtol=1e-14)


def test_no_turn_is_the_identity():
    assert (rotation_from_vector(np.zeros((2, 3))) == np.eye(3)).all()


@given(st.tuples(part, part, part))
def test_every_turn_is_as_scipy_has_it(omega):
    assert rotation_from_vector(omega) == pytest.approx(Rotation.from_rotvec(omega).as_matrix(), abs=1e-12)


def test_many_turns_of_any_leading_axes_are_those_of_one_by_one():
    omega = np.random.default_rng(0).normal(size=(2, 5, 3))
    one_by_one = [[rotation_from_vector(w) for w in row] for row in omega]
    np.testing.assert_allclose(rotation_from_vector(omega), one_by_one, atol=1e-15)


def test_a_turn_that_is_not_known_is_nan():
    turns = rotation_from_vector([[np.nan, 0, 0], [0, 0, 0.1]])
    assert np.isnan(turns[0]).all()
    assert np.isfinite(turns[1]).all()
