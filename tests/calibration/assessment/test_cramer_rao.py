"""The floor that centroid noise sets, against the notes' measured one and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.calibration.assessment.cramer_rao import located_covariance, mean_length
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_points, thesis_rig


def test_the_thesis_rig_has_the_floor_that_was_measured():
    """Measured beforehand on a like rig: mean 3-D error 0.366 in per px of centroid noise."""
    p = np.random.default_rng(0).uniform(-1, 1, (500, 3)) * thesis_points()[1].max(0)
    mean = mean_length(located_covariance(thesis_rig(), p, 1.0)).mean()
    assert mean == pytest.approx(0.366, rel=0.02)


def test_simulated_points_scatter_as_the_floor_says():
    rng = np.random.default_rng(1)
    cameras, p = thesis_rig(3), np.tile((5.0, 2.0, -3.0), (4000, 1))
    b = np.array([project(camera, p) for camera in cameras]) + rng.normal(0, 0.1, (3, 4000, 2))
    error = locate_points(cameras, b, sd=0.1).point - p
    C = located_covariance(cameras, p[:1], 0.1)[0]
    np.testing.assert_allclose(np.cov(error.T), C, atol=0.06 * C.max())  # 4000 samples: 2.2 % of a variance
    assert np.linalg.norm(error, axis=-1).mean() == pytest.approx(mean_length(C), rel=0.02)


def test_two_cameras_at_right_angles_by_hand():
    """0.25 units/px each: .25 across one line of sight only, .25/sqrt(2) where both see."""
    along_x = np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]])
    along_y = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    cameras = [
        Camera(256, 240, 0.01, 0.01, 1, 6.4, 0, R, np.array([0, 0, 160.0]), (512, 480)) for R in (along_x, along_y)
    ]
    sd = np.sqrt(np.diag(located_covariance(cameras, np.zeros((1, 3)), 1.0)[0]))
    np.testing.assert_allclose(sd, [0.25, 0.25, 0.25 / np.sqrt(2)], rtol=1e-9)


def test_mean_length_has_the_closed_forms_of_round_and_flat_errors():
    assert mean_length(np.eye(3)) == pytest.approx(np.sqrt(8 / np.pi), rel=1e-9)
    assert mean_length(np.diag([1, 1, 0.0])) == pytest.approx(np.sqrt(np.pi / 2), rel=1e-5)  # Rayleigh
    assert mean_length(np.diag([1, 0, 0.0])) == pytest.approx(np.sqrt(2 / np.pi), rel=1e-3)
    assert np.isnan(mean_length(np.full((2, 3, 3), np.nan))).all()


@settings(max_examples=20, deadline=None)
@given(s=st.lists(st.floats(0.05, 2), min_size=3, max_size=3), seed=st.integers(0, 99))
def test_mean_length_is_that_of_drawn_errors_whatever_their_axes(s, seed):
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    drawn = np.linalg.norm(rng.normal(size=(40000, 3)) * s, axis=-1)
    expected = mean_length(Q @ np.diag(np.square(s)) @ Q.T)
    assert expected == pytest.approx(drawn.mean(), abs=5 * drawn.std() / 200)


def test_a_point_that_one_camera_sees_has_no_floor():
    seen = np.array([[True, True], [True, False]])
    C = located_covariance(thesis_rig(), np.zeros((2, 3)), 0.1, seen)
    assert np.isfinite(C[0]).all()
    assert np.isnan(C[1]).all()
