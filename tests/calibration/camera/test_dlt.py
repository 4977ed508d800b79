"""The direct linear transformation, on exact points and on mirrors."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.calibration.camera.test_tsai import cloud_before
from tests.geometry.test_camera import cameras
from vidtrack.calibration.camera.dlt import (
    camera_from_dlt,
    decomposed,
    dlt,
    homography,
    project_dlt,
    project_homography,
)
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig


@settings(max_examples=30, deadline=None)
@given(cameras())
def test_a_camera_without_lens_is_found_with_its_centre_and_Sx(camera):
    camera = camera.without_lens().with_(projection="perspective")
    p = cloud_before(camera)
    b = project(camera, p)
    P = dlt(p, b)
    np.testing.assert_allclose(project_dlt(P, p), b, atol=1e-5)
    found = camera_from_dlt(P, dx=camera.dx, dy=camera.dy, image_size=camera.image_size)
    for name in ("Cx", "Cy", "Sx", "f"):
        assert getattr(found, name) == pytest.approx(getattr(camera, name), rel=1e-4, abs=1e-3), name
    np.testing.assert_allclose(found.R, camera.R, atol=1e-5)


def test_a_mirror_shows_in_the_determinant():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    b = project(camera, p)
    assert decomposed(dlt(p, b)).handed == 1
    assert decomposed(dlt(p * [1, -1, 1], b)).handed == -1
    with pytest.raises(ValueError, match="mirrored"):
        camera_from_dlt(dlt(p * [1, -1, 1], b), dx=1, dy=1, image_size=(512, 480))


def test_many_samples_at_once_are_many_fits():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    b = project(camera, p)
    pick = np.random.default_rng(0).permuted(np.tile(np.arange(64), (5, 1)), axis=1)[:, :9]
    P = dlt(p[pick], b[pick])
    np.testing.assert_allclose(project_dlt(P, p)[3], project_dlt(dlt(p[pick[3]], b[pick[3]]), p), atol=1e-6)


def test_a_far_origin_costs_nothing():
    camera = thesis_rig(1)[0].with_(kappa1=0.0)
    p = thesis_points()[1]
    b = project(camera, p)
    np.testing.assert_allclose(project_dlt(dlt(p + 1e4, b), p + 1e4), b, atol=1e-5)


def test_five_points_are_too_few():
    with pytest.raises(ValueError, match="5 points; the direct linear transformation needs 6"):
        dlt(np.zeros((5, 3)), np.zeros((5, 2)))


def test_four_corners_give_the_homography():
    # the unit square to a trapezium; its diagonals cross where theirs do
    q = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    b = np.array([[0, 0], [4, 0], [3, 2], [1, 2.0]])
    H = homography(q, b)
    np.testing.assert_allclose(project_homography(H, q), b, atol=1e-10)
    np.testing.assert_allclose(project_homography(H, [[0.5, 0.5]]), [[2, 4 / 3]], atol=1e-10)
