"""Where a calibration is worse than usual, by its own covariance, more is left to it."""

import numpy as np
import pytest

from vidtrack.association.associate import associate
from vidtrack.association.tracklets import tracklets_of
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import columns, derivatives, stepped
from vidtrack.location.sight_lines.picture_error import MOST, unevenness
from vidtrack.simulate.rig import thesis_rig

NAMES = ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z", "f", "Cx", "Cy", "kappa1")
T = np.arange(150) / 30


def calibrated(camera, rng, sd=0.03):
    """The camera as 20 points on one side of the room show it, in error by what they leave open."""
    points = rng.uniform((-20, -12, -8), (5, 12, 8), (20, 3))
    pivot = points.mean(axis=0)
    J = derivatives(camera, points, pivot).by_parameter[..., columns(camera, NAMES)].reshape(-1, len(NAMES))
    C = np.linalg.inv(J.T @ J / sd**2)
    step = rng.multivariate_normal(np.zeros(len(NAMES)), C)
    return stepped(camera, pivot, dict(zip(NAMES, step, strict=True))), Uncertainty(NAMES, pivot, C)


def test_it_is_the_error_of_the_calibration_by_place():
    camera = thesis_rig(1)[0]
    rng = np.random.default_rng(0)
    uncertainty = calibrated(camera, np.random.default_rng(1))[1]
    draws = rng.multivariate_normal(np.zeros(len(NAMES)), uncertainty.covariance, 300)
    world = np.array([[-15.0, -8, 0], [-5, 0, 0], [0, 5, 0], [18, 0, 0], [28, 8, 0]])
    places = project(camera, world)
    off = [project(stepped(camera, uncertainty.pivot, dict(zip(NAMES, own, strict=True))), world) for own in draws]
    rms = np.sqrt(np.mean((np.array(off) - places) ** 2, axis=0))
    got = unevenness(camera, uncertainty, places)
    expected = np.maximum(rms / np.median(rms, axis=0), 1)
    assert np.abs(np.log(got / expected)).max() < 0.5  # points are not all as far away as the grid takes them to be
    assert got.max() > 1.5


def test_it_is_one_where_nothing_is_known_and_never_beyond_what_is_believed():
    camera = thesis_rig(1)[0]
    b = np.random.default_rng(0).uniform(0, 480, (50, 2))
    assert (unevenness(camera, None, b) == 1).all()
    got = unevenness(camera, calibrated(camera, np.random.default_rng(1))[1], b)
    assert got.min() >= 1
    assert got.max() <= MOST
    assert unevenness(camera, None, np.zeros((0, 2))).shape == (0, 2)


@pytest.mark.parametrize("seed", [2, 4, 7, 9, 11])
def test_a_target_in_the_corner_of_one_camera_s_picture_is_not_lost_there(seed):
    rng = np.random.default_rng(seed)
    cameras = thesis_rig(4)
    used, known = zip(*(calibrated(camera, rng) for camera in cameras), strict=True)
    n = 8
    middle = rng.uniform((-25, -14, -8), (28, 14, 8), (n, 1, 3))
    reach, hz, phase = rng.uniform(2, 4, (n, 1, 3)), rng.uniform(2, 5, (n, 1, 1)), rng.uniform(0, 6, (n, 1, 3))
    p = middle + reach * np.sin(hz * T[:, None] + phase)
    tracklets = []
    for camera in cameras:
        b = project(camera, p)
        seen = ((b > 0) & (b < np.array(camera.image_size) - 1)).all(-1)
        k, moment = np.nonzero(seen)
        own = (b + rng.normal(0, 0.02, b.shape))[k, moment]
        tracklets.append(tracklets_of(k, moment, own, np.full(own.shape, 0.02)))
    uneven = [unevenness(c, u, t.b) for c, u, t in zip(used, known, tracklets, strict=True)]

    def alone(found):
        assert all(len({k for t in found.trajectory for k in np.flatnonzero(t == m)}) == 1 for m in range(found.m))
        return sum(int((t < 0).sum()) for t in found.trajectory)

    assert alone(associate(used, tracklets, targets=n)) > 0
    assert alone(associate(used, tracklets, targets=n, uneven=uneven)) == 0
