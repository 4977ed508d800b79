import numpy as np
import pytest

from tests.geometry.underwater import ABOVE, LEFT, RIGHT, WEDGE, places
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.geometry.bent import bent
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import stepped
from vidtrack.geometry.triangulate import locate_points

PLAIN = LEFT.with_(through=())
RIGS = [(LEFT, RIGHT), (LEFT, RIGHT, ABOVE), (LEFT.with_(through=()), ABOVE), (WEDGE, RIGHT)]


def seen(cameras, p):
    return np.array([project(camera, p) for camera in cameras])


@pytest.mark.parametrize("cameras", RIGS)
@pytest.mark.parametrize("refine", [True, False])
def test_points_on_both_sides_are_located_exactly(cameras, refine):
    p = places(400)
    found = locate_points(cameras, seen(cameras, p), sd=0.1, refine=refine)
    assert np.abs(found.point - p).max() < 1e-7
    assert np.abs(found.error).max() < 1e-8
    assert found.miss.max() < 1e-7


@pytest.mark.parametrize("cameras", RIGS)
@pytest.mark.parametrize("refine", [True, False])
def test_sigma_is_the_scatter(cameras, refine):
    p = places(3000)
    b = seen(cameras, p) + np.random.default_rng(1).normal(0, 0.1, (len(cameras), len(p), 2))
    found = locate_points(cameras, b, sd=0.1, refine=refine)
    np.testing.assert_allclose(((found.point - p) / found.sigma).std(0), 1, atol=0.06)


def test_without_the_interface_points_are_millimetres_off():
    p = places(100)
    plain = [camera.with_(through=()) for camera in (LEFT, RIGHT)]
    found = locate_points(plain, seen((LEFT, RIGHT), p), sd=0.1)
    assert np.linalg.norm(found.point - p, axis=-1).min() > 20


def test_the_covariance_has_the_interfaces_errors():
    # by moving each parameter by its standard error and locating again
    cameras = [LEFT, RIGHT, ABOVE]
    p = places(40)
    b = seen(cameras, p)
    window = ("omega_x", "t_y", "f", "window.position", "window.tilt_1", "window.thickness_1", "window.index_2")
    sd = np.array([1e-4, 0.1, 0.01, 1.0, 1e-3, 0.3, 1e-3])
    known = [Uncertainty(window, p.mean(0), np.diag(sd**2))] * 2
    known.append(Uncertainty(("surface.position", "surface.tilt_2"), p.mean(0), np.diag([1.0, 1e-6])))
    before = locate_points(cameras, b, sd=0.01)
    found = locate_points(cameras, b, sd=0.01, uncertainties=known)
    expected = np.zeros((len(p), 3, 3))
    for i, own in enumerate(known):
        for name, error in zip(own.names, own.standard_errors, strict=True):
            moved = list(cameras)
            moved[i] = stepped(cameras[i], own.pivot, {name: 0.1 * error})
            by = (locate_points(moved, b, sd=0.01).point - before.point) / 0.1
            expected += by[:, :, None] * by[:, None, :]
    added = found.covariance - before.covariance
    # a block's lens is taken at the measured pixel: within a share of the error itself
    np.testing.assert_allclose(added, expected, atol=0.02 * np.abs(expected).max())


def test_a_shared_window_is_one_error_not_two():
    cameras, p = [LEFT, RIGHT], places(20)
    b = seen(cameras, p)
    own = Uncertainty(("window.position",), p.mean(0), np.eye(1))
    joint = locate_points(cameras, b, sd=0.01, uncertainties=[own, own], joint=np.ones((2, 2)))
    moved = [stepped(camera, p.mean(0), {"window.position": 1.0}) for camera in cameras]
    by = locate_points(moved, b, sd=0.01).point - p
    np.testing.assert_allclose(joint.sigma, np.abs(by), rtol=0.02, atol=0.02)


def test_light_that_is_reflected_is_not_used():
    tangents = np.array([[0.0, 8.0], [0.0, 0.0]])
    diver = LEFT.with_(through=(LEFT.through[0].stepped({"window.index_2": -0.3}),))
    path = bent(diver, tangents, np.zeros(3))
    assert path.there[0]
    assert np.isfinite(path.path[-1].q).all()


def test_lost_measurements_leave_the_other_cameras_their_fix():
    p = places(5)
    b = seen((LEFT, RIGHT, ABOVE), p)
    b[2, 1] = np.nan
    b[:2, 2] = np.nan
    found = locate_points((LEFT, RIGHT, ABOVE), b, sd=0.1)
    np.testing.assert_array_equal(found.n_cameras, [3, 2, 0, 3, 3])
    np.testing.assert_allclose(found.point[1], p[1], atol=1e-8)
    assert np.isnan(found.point[2]).all()
