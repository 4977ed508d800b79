"""The adjustment by a body: what it finds, how sure it is, how many samples count as one."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment.measurements import KnownCameras
from vidtrack.calibration.body.body_fit import alikeness, fit_body, refitted
from vidtrack.calibration.body.body_sights import Body, BodySights, usable
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import stepped
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import thesis_rig

P = np.array([[14.0, 0, 3], [-9.0, 10, 3], [-9.0, -10, 2], [1.0, 2, 14]])
BODY = Body(("bow", "port", "starboard", "mast"), P, 0.001)
FREE = free_parameters("tsai", ("Sx", "Cx", "Cy"))
SD = {"f": 0.05, "kappa1": 5e-5, "omega_x": 1e-3, "omega_y": 1e-3, "omega_z": 1e-3, "t_x": 0.1, "t_y": 0.1, "t_z": 0.3}
PIVOTS = np.array([[3.0, -2, 1], [-4.0, 0, 2]])


def _scene(seed, n=60, noise=0.1):
    """Cameras that another calibration knows only roughly, each about a pivot of its own, and a body before them."""
    rng = np.random.default_rng(seed)
    truth = thesis_rig(2)
    sd = np.array([SD[name] for name in FREE])
    known = [
        stepped(c, pivot, dict(zip(FREE, rng.normal(0, sd).tolist(), strict=True)))
        for c, pivot in zip(truth, PIVOTS, strict=True)
    ]
    R = np.stack([rotation_from_vector(v) for v in rng.normal(0, 0.2, (n, 3))])
    x = P @ np.swapaxes(R, -1, -2) + rng.uniform(-15, 15, (n, 1, 3))
    b = np.stack([project(c, x) for c in truth]) + rng.normal(0, noise, (2, n, 4, 2))
    prior = KnownCameras(known, [FREE, FREE], PIVOTS, np.diag(np.tile(sd**2, 2)))
    sights, poses = usable(known, BodySights(b, np.full(b.shape, noise), np.zeros(n, int)), BODY)
    return truth, prior, sights, poses


def test_focal_lengths_are_found_and_their_sigma_is_honest():
    z, before = [], []
    for seed in range(12):
        truth, prior, sights, poses = _scene(seed)
        done = fit_body(prior, sights, BODY, poses)
        assert done.converged
        for i, camera in enumerate(truth):
            k = i * len(FREE) + FREE.index("f")
            z.append((done.cameras[i].f - camera.f) / np.sqrt(done.covariance[k, k]))
            before.append((prior.cameras[i].f - camera.f) / np.sqrt(done.covariance[k, k]))
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.3
    assert np.sqrt(np.mean(np.square(before))) > 3


def test_the_distance_between_targets_is_that_of_the_body_afterwards():
    truth, prior, sights, poses = _scene(3, noise=0.01)
    from vidtrack.geometry.triangulate import locate_points

    def off(cameras):
        p = locate_points(cameras, sights.b, sd=0.1).point
        return np.abs(np.linalg.norm(p[:, 0] - p[:, 1], axis=-1) - np.linalg.norm(P[0] - P[1])).mean()

    assert off(refitted(prior, sights, BODY, poses)) < 0.2 * off(prior.cameras)
    assert off(truth) < off(prior.cameras)


def test_a_sight_that_is_far_off_is_left_out():
    _, prior, sights, poses = _scene(5)
    b = sights.b.copy()
    b[1, 7, 2] += 6
    done = fit_body(prior, sights._replace(b=b), BODY, poses)
    assert np.isnan(done.sights.b[1, 7, 2]).all()
    assert np.isnan(done.sights.b).sum() <= 2


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_residuals_that_are_alike_count_as_fewer(rho):
    """Of a first-order series (1 + rho) / (1 - rho) samples say as much as one independent one."""
    rng = np.random.default_rng(0)
    r = rng.normal(0, 1, (2, 4000, 3, 2))
    for k in range(1, 4000):
        r[:, k] = rho * r[:, k - 1] + np.sqrt(1 - rho**2) * r[:, k]
    sights = BodySights(r, np.ones(r.shape), np.zeros(4000, int))
    assert alikeness(r, sights) == pytest.approx((1 + rho) / (1 - rho), rel=0.1)
    apart = sights._replace(run=np.arange(4000))
    assert alikeness(r, apart) == pytest.approx(1.0), "moments of different runs are not neighbours"
