"""One plane in water, seen by one camera through a window: light is bent, and positions and their sigma know it."""

import numpy as np
import pytest

from vidtrack.calibration.camera.plane_camera import plane_camera, positions
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.interface import Interface

WINDOW = Interface("window", np.array([0.0, 0, 300]), np.array([0.0, 0, -1]), (1.0, 1.49, 1.333), (20.0,))


def looking(at, f=700.0, through=(WINDOW,)):
    z = -np.array(at, float) / np.linalg.norm(at)
    x = np.cross([0, 1.0, 0], z)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    return Camera(319.5, 239.5, 1, 1, 1.0, f, 0.0, R, -R @ np.array(at, float), (640, 480), through=through)


def grid(n=6, reach=250.0):
    line = np.linspace(-reach, reach, n)
    return np.stack(np.meshgrid(line, 0.7 * line, [0.0]), -1).reshape(-1, 3)


def fitted(camera, rng, noise=0.1, p=None):
    p = grid() if p is None else p
    b = project(camera, p) + rng.normal(0, noise, (len(p), 2))
    given = {"centre": (319.5, 239.5), "image_size": (640, 480)}
    return plane_camera(p, b, [WINDOW], sd=np.full(b.shape, max(noise, 0.02)), sigma=np.zeros(len(p)), **given)


@pytest.mark.parametrize("at", [(0, 0, 1200), (350, -150, 1100)])
def test_positions_in_the_plane_are_right_within_their_sigma(at):
    camera = looking(at)
    rng = np.random.default_rng(0)
    q = np.column_stack([rng.uniform(-230, 230, 300), rng.uniform(-160, 160, 300)])
    z = []
    for seed in range(4):
        done = fitted(camera, np.random.default_rng(seed))
        b = project(camera, np.column_stack([q, np.zeros(300)])) + rng.normal(0, 0.1, (300, 2))
        p, covariance = done.located(b, np.full((300, 2), 0.1))
        z.append(np.einsum("na,nab,nb->n", p - q, np.linalg.inv(covariance), p - q).mean() / 2)
        assert np.linalg.norm(p - q, axis=-1).mean() < 0.6  # 0.1 px is 0.15 mm there
    assert 0.64 < np.mean(z) < 1.56  # 0.8 to 1.25 squared


def test_exact_sights_of_the_true_camera_give_the_plane_back():
    camera = looking((350, -150, 1100))
    p = grid()
    np.testing.assert_allclose(positions(camera, project(camera, p), 0.0), p[:, :2], atol=1e-6)
    away = positions(camera, np.array([[319.5, 239.5]]), 5000.0)
    assert np.isnan(away).all(), "a plane behind the camera is met by no line of sight"


def test_too_few_points_give_none():
    assert fitted(looking((0, 0, 1200)), np.random.default_rng(0), p=grid()[:5]) is None
