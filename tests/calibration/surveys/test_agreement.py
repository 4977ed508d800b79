"""Where several cameras together see a point, to first order."""

import numpy as np

from tests.calibration.rigs import ring, wires
from vidtrack.calibration.surveys.agreement import displaced
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.triangulate import locate_points

RNG = np.random.default_rng(2)
CAMERAS = ring(3, RNG)
P = wires()[1]
WEIGHT = np.broadcast_to(np.eye(2) / 0.25, (3, 25, 2, 2))
BY_POINT = np.stack([derivatives(camera, P, P.mean(0)).by_point for camera in CAMERAS])


def test_the_displacement_is_where_the_lines_of_sight_meet_with_the_covariance_of_a_fix():
    x = P + np.array([1.0, -2.0, 3.0])
    error = np.stack([project(camera, x) - project(camera, P) for camera in CAMERAS])
    d, C = displaced(error, WEIGHT, BY_POINT)
    np.testing.assert_allclose(d, x - P, atol=0.02)
    fix = locate_points(CAMERAS, np.stack([project(camera, P) for camera in CAMERAS]), sd=0.5)
    np.testing.assert_allclose(C, fix.covariance, rtol=1e-3, atol=1e-9)


def test_one_camera_alone_sees_no_displacement():
    error = np.full((3, 25, 2), np.nan)
    error[0] = 1.0
    d, C = displaced(error, np.where(np.isfinite(error)[..., None], WEIGHT, 0), BY_POINT)
    assert np.isnan(d).all()
    assert np.isnan(C).all()
