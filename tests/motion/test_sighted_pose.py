"""The pose of a body from pictures is the likeliest, its covariance honest; of two that look alike neither is taken."""

from dataclasses import replace

import numpy as np
import pytest

from tests.motion.tags import SQUARE, F, errors, poses, rig, seen, z_of
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.jacobian import stepped
from vidtrack.location.cameras.run_pictures import Uncertain
from vidtrack.motion.planar_start import planar_start
from vidtrack.motion.sighted_pose import Placed, sighted_pose, with_calibration


def fitted(sightings, known=None):
    return sighted_pose(sightings, planar_start(sightings.cameras[0], sightings.b[0], SQUARE), known)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_covariance_is_honest_with_one_camera_and_with_several(n):
    origin, R = poses(T=150)
    pose = fitted(seen(rig(n), SQUARE, origin, R))
    sure = ~pose.unsure
    assert sure.mean() > 0.9
    assert 0.9 < z_of(errors(pose, origin, R)[sure], pose.covariance[sure]) < 1.1
    assert np.mean(pose.chi2 / pose.spare) == pytest.approx(1.0, abs=0.15)


def test_a_picture_without_noise_gives_the_pose_exactly():
    origin, R = poses(T=20)
    sightings = seen(rig(1), SQUARE, origin, R, sd=1e-9)
    error = errors(fitted(sightings._replace(sd=np.full(sightings.sd.shape, 0.01))), origin, R)
    assert np.abs(error).max() < 1e-5


def test_of_two_poses_that_look_alike_neither_is_taken():
    """A tag of 25 px, nearly square on, with 0.3 px of noise: among those that count none is the wrong one."""
    origin, R = poses(T=300, tilt=0.25, distance=6000.0)
    pose = fitted(seen(rig(1), SQUARE, origin, R, sd=0.3))
    assert pose.unsure.mean() > 0.7
    off = errors(pose, origin, R)
    far = np.linalg.norm(off[:, :3], axis=-1) > 6 * np.sqrt(np.trace(pose.covariance[:, :3, :3], axis1=1, axis2=2))
    assert (far & pose.unsure).any()  # there were such as would have been wrong
    assert not (far & ~pose.unsure).any()


def test_a_second_camera_or_a_second_face_decides():
    origin, R = poses(T=100, tilt=0.25, distance=3000.0)
    assert fitted(seen(rig(1), SQUARE, origin, R, sd=0.2)).unsure.any()
    assert not fitted(seen(rig(2), SQUARE, origin, R, sd=0.2)).unsure.any()
    other = SQUARE @ np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]) + [60, 0, -60]
    sightings = seen(rig(1), np.concatenate([SQUARE, other]), origin, R, sd=0.2)
    start = planar_start(sightings.cameras[0], sightings.b[0, :, :4], SQUARE)
    assert not sighted_pose(sightings, start).unsure.any()


@pytest.mark.parametrize("n", [1, 2])
def test_what_the_calibration_errs_is_in_the_covariance(n):
    """Each trial has cameras of its own that err as their covariance says; all together 0.8 to 1.25 of sigma."""
    names = ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z", "f", "Cx", "Cy", "kappa1")
    sd = np.array([2e-4, 2e-4, 2e-4, 0.3, 0.3, 0.8, 1.0, 1.5, 1.5, 0.005 / F**2])
    pivot, rng = np.array([0.0, 0.0, 1500.0]), np.random.default_rng(5)
    z = []
    for trial in range(40):
        cameras = rig(n)
        known = [Uncertain(names, pivot, np.diag(sd**2)) for _ in cameras]
        true = [stepped(c, pivot, dict(zip(names, (sd * rng.normal(size=10)).tolist(), strict=True))) for c in cameras]
        origin, R = poses(T=1, seed=trial)
        pose = fitted(seen(cameras, SQUARE, origin, R, sd=0.02, seed=trial, truth=true), known)
        whole = with_calibration(pose, known, None)
        if not pose.unsure[0]:
            z.append(z_of(errors(pose, origin, R), whole))
        joint = np.kron(np.eye(n), np.diag(sd**2))
        np.testing.assert_allclose(with_calibration(pose, known, joint), whole, rtol=1e-9, atol=1e-12)
    assert len(z) > 30
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.25


def test_a_camera_that_looks_through_a_window_into_water_sees_the_pose():
    window = Interface("window", np.array([0, 0, 500.0]), np.array([0, 0, 1.0]), (1.0, 1.49, 1.333), (10.0,))
    camera = replace(rig(1)[0], through=(window,))
    origin, R = poses(T=40)
    pose = fitted(seen([camera], SQUARE, origin, R, sd=0.02))
    sure = ~pose.unsure
    assert sure.mean() > 0.9
    assert 0.8 < z_of(errors(pose, origin, R)[sure], pose.covariance[sure]) < 1.25


def test_other_targets_that_were_located_help():
    origin, R = poses(T=40)
    sightings = seen(rig(1), SQUARE, origin, R, sd=0.05)
    balls = np.array([[300.0, 0, 0], [0, 300, 50], [-300, 0, 80]])
    p = origin[:, None] + balls @ np.swapaxes(R, -1, -2)
    p = p + np.random.default_rng(1).normal(0, 0.1, p.shape)
    p[::4, 1] = np.nan
    placed = Placed(balls, p, np.broadcast_to(np.eye(3) / 0.1**2, (*p.shape, 3)))
    both, alone = fitted(sightings._replace(placed=placed)), fitted(sightings)
    assert (np.trace(both.covariance, axis1=1, axis2=2) < 0.2 * np.trace(alone.covariance, axis1=1, axis2=2)).all()
    assert 0.8 < z_of(errors(both, origin, R), both.covariance) < 1.25


def test_what_is_not_seen_has_no_pose():
    origin, R = poses(T=5)
    sightings = seen(rig(2), SQUARE, origin, R)
    sightings.b[:, 2] = np.nan
    sightings.b[0, 3, 1] = np.nan
    pose = fitted(sightings)
    assert np.isnan(pose.origin[2]).all()
    assert not pose.unsure[2]
    assert np.isfinite(pose.origin[[0, 1, 4]]).all()
