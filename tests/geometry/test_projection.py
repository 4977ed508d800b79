"""Equidistant lenses: the closed forms against their inverse, and whole cameras against OpenCV's fisheye model."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.geometry.camera import Camera, line_of_sight, project
from vidtrack.geometry.projection import (
    equidistant_from_perspective,
    perspective_by_f,
    perspective_from_equidistant,
    perspective_jacobian,
)
from vidtrack.geometry.rotation import rotation_from_vector

F = 5.0
places = st.tuples(st.floats(-5, 5), st.floats(-5, 5)).map(np.array)


def test_a_ray_at_45_degrees_lies_at_f_in_perspective_and_at_f_pi_over_4_equidistant():
    np.testing.assert_allclose(perspective_from_equidistant(np.array([F * np.pi / 4, 0]), F), [F, 0])
    np.testing.assert_allclose(equidistant_from_perspective(np.array([0, F]), F), [0, F * np.pi / 4])


@given(places)
def test_one_undoes_the_other(e):
    np.testing.assert_allclose(equidistant_from_perspective(perspective_from_equidistant(e, F), F), e, atol=1e-12)


@given(places)
def test_the_derivatives_are_those_of_finite_differences(e):
    h = 1e-6
    steps = h * np.eye(2)
    ups, downs = (np.stack([perspective_from_equidistant(e + s * d, F) for d in steps], -1) for s in (1, -1))
    numeric = (ups - downs) / (2 * h)
    np.testing.assert_allclose(perspective_jacobian(e, F), numeric, rtol=1e-5, atol=1e-6)
    by_f = (perspective_from_equidistant(e, F + h) - perspective_from_equidistant(e, F - h)) / (2 * h)
    np.testing.assert_allclose(perspective_by_f(e, F), by_f, rtol=1e-5, atol=1e-6)


def test_there_is_no_pinhole_position_at_90_degrees_and_beyond():
    assert np.isnan(perspective_from_equidistant(np.array([F * np.pi / 2, 0]), F)).all()
    assert np.isfinite(perspective_from_equidistant(np.array([F * 1.57, 0]), F)).all()


@pytest.mark.parametrize("half_deg", [30, 60, 80])
def test_an_equidistant_camera_without_terms_is_opencv_s_fisheye(half_deg):
    R, T = rotation_from_vector([0.2, -0.3, 0.1]), np.array([3.0, -2, 10])
    camera = Camera(640, 480, 1, 1, 1.0, 400.0, 0.0, R, T, (1280, 960), projection="equidistant")
    angle = np.linspace(0, 2 * np.pi, 24)
    t = np.radians(half_deg)
    c = 50 * np.stack([np.sin(t) * np.cos(angle), np.sin(t) * np.sin(angle), np.full(24, np.cos(t))], -1)
    p = (c - T) @ R
    K = np.array([[400.0, 0, 640], [0, 400, 480], [0, 0, 1]])
    theirs = cv2.fisheye.projectPoints(p[:, None], cv2.Rodrigues(R)[0], T, K, np.zeros(4))[0][:, 0]
    np.testing.assert_allclose(project(camera, p), theirs, atol=1e-9)
    origin, direction = line_of_sight(camera, theirs)
    np.testing.assert_allclose(np.cross(p - origin, direction), 0, atol=1e-9)
