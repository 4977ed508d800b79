import numpy as np
import pytest

from vidtrack.calibration.assessment.field_of_view import diagonal_field, field_of_view, mean_depth, pixels_across
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.rig import thesis_points, thesis_rig


def test_the_thesis_rig_has_a_diagonal_field_of_160():
    """The thesis: 128 in wide with a 4:3 picture, a diagonal of 160 in, and 0.11 in are 1/1350 to 1/1450 of it."""
    diagonal = diagonal_field(thesis_rig(), thesis_points()[1])
    assert diagonal == pytest.approx(160, rel=0.01)
    field = field_of_view(thesis_rig()[0], 160.0)
    assert field.width == pytest.approx(128, rel=0.01)
    assert field.height == pytest.approx(96, rel=0.02)


def test_a_plain_camera_by_hand():
    camera = Camera(200.0, 100, 0.02, 0.01, 1, 10, 0, np.eye(3), np.array([0, 0, 50.0]), (500, 400))
    assert field_of_view(camera, 50) == pytest.approx((50.0, 20.0, np.hypot(50, 20)))
    assert mean_depth(camera, np.array([[0, 0, 0], [5, 5, 20.0]])) == pytest.approx(60)
    # 2 units at 50: 20 columns and 40 rows
    assert pixels_across(camera, [0, 0, 0.0], 2.0) == pytest.approx(30)
    assert np.isnan(pixels_across(camera, [0, 0, -60.0], 2.0))


def test_the_field_ends_where_points_leave_the_picture():
    camera = thesis_rig()[0]
    field = field_of_view(camera, 150.0)
    edge = camera.position + camera.R.T @ [0, 0, 150.0]
    left = edge - camera.R[0] * field.width * 0.6
    right = edge + camera.R[0] * field.width * 0.6
    assert project(camera, left)[0] < 0
    assert project(camera, right)[0] > 511


def test_a_lens_that_folds_inside_the_picture_still_has_a_field():
    camera = thesis_rig()[0].with_(kappa1=-0.05)
    assert np.isfinite(field_of_view(camera, 160.0)).all()
