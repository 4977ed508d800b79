"""The terms of the lens model, against OpenCV's equations and their own derivatives."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.lens_terms import COEFFICIENTS, LENS_MODELS, RADIAL, RICHEST, TERMS, unit_power

places = st.tuples(st.floats(-4, 4), st.floats(-4, 4)).map(np.array)
some = settings(max_examples=40, deadline=None)


def shifted(name, x, y, coefficient=1.0):
    by_x, by_y = TERMS[name].shift(x, y, x * x + y * y)
    return np.stack([x + coefficient * by_x, y + coefficient * by_y], -1)


def opencv_s(name, x, y, coefficient):
    """OpenCV applies the same polynomials to a point at unit distance; its p1 acts along y, its prism is s1 and s3."""
    order = ["kappa1", "kappa2", "p2", "p1", "kappa3", None, None, None, "s1", None, "s2", None]
    distortion = np.array([coefficient if term == name else 0.0 for term in order])
    p = np.stack([x, y, np.ones_like(x)], -1)
    return cv2.projectPoints(p, np.zeros(3), np.zeros(3), np.eye(3), distortion)[0][:, 0]


@pytest.mark.parametrize("name", [name for name in TERMS if name not in ("q1", "q2")])
def test_every_term_that_opencv_has_is_opencv_s(name):
    x, y = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 50))
    np.testing.assert_allclose(shifted(name, x, y, 0.3), opencv_s(name, x, y, 0.3), atol=1e-12)


def test_with_q1_and_q2_the_terms_of_second_order_are_complete():
    """x^2, x y and y^2 in each coordinate: six functions, six terms."""
    x, y = np.random.default_rng(1).uniform(-1, 1, (2, 40))
    terms = np.stack(
        [np.concatenate(TERMS[n].shift(x, y, x * x + y * y)) for n in ("p1", "p2", "s1", "s2", "q1", "q2")]
    )
    monomials = np.stack([x * x, x * y, y * y])
    wanted = np.block([[monomials, 0 * monomials], [0 * monomials, monomials]])
    assert np.linalg.matrix_rank(terms) == 6
    assert np.linalg.matrix_rank(np.concatenate([terms, wanted])) == 6


@pytest.mark.parametrize("name", TERMS)
@some
@given(places)
def test_the_slope_is_the_derivative_of_the_shift(name, place):
    h = 1e-5
    x, y = place
    by_x = (shifted(name, x + h, y) - shifted(name, x - h, y)) / (2 * h) - [1, 0]
    by_y = (shifted(name, x, y + h) - shifted(name, x, y - h)) / (2 * h) - [0, 1]
    xx, xy, yx, yy = TERMS[name].slope(x, y, x * x + y * y)
    scale = max(np.abs([xx, xy, yx, yy]).max(), 1.0)
    np.testing.assert_allclose([[xx, yx], [xy, yy]], [by_x, by_y], atol=1e-6 * scale)


@pytest.mark.parametrize("name", TERMS)
@some
@given(places, st.floats(0.1, 10))
def test_a_coefficient_changes_with_the_unit_of_length_as_its_power_says(name, place, unit):
    """The same lens in another unit: coordinates times `unit`, the coefficient over unit^power."""
    x, y = place
    other = shifted(name, x * unit, y * unit, 0.01 / unit ** unit_power(name))
    np.testing.assert_allclose(other, shifted(name, x, y, 0.01) * unit, rtol=1e-12, atol=1e-15)


def test_skew_has_no_unit_and_every_other_coefficient_has_a_term():
    assert unit_power("skew") == 0
    assert set(COEFFICIENTS) == {*TERMS, "skew"}
    assert {name: unit_power(name) for name in RADIAL} == {"kappa1": 2, "kappa2": 4, "kappa3": 6}


def test_the_models_go_from_plain_to_rich():
    assert next(iter(LENS_MODELS)) == "tsai"
    assert set(LENS_MODELS[RICHEST]) == set(COEFFICIENTS)
    sizes = [len(terms) for terms in LENS_MODELS.values()]
    assert sizes == sorted(sizes)
    assert all(set(terms) <= set(COEFFICIENTS) for terms in LENS_MODELS.values())
