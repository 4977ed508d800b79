"""A camera from a few points predicts where the others are, and knows how well."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.pose import F_STARTS, RICH, adjust, poses, predicted, starting_poses
from vidtrack.simulate.rig import look_at, thesis_points, thesis_rig

SIZE = (512, 480)


def camera_at(seed):
    rng = np.random.default_rng(seed)
    position = rng.normal(size=3)
    position *= rng.uniform(2.5, 6) / np.linalg.norm(position)
    R = look_at(position, rng.uniform(-0.2, 0.2, 3), roll_deg=rng.uniform(-180, 180))
    f = rng.uniform(0.9, 1.1) * 130 * np.linalg.norm(position)
    C = rng.normal((255.5, 239.5), 12)
    return Camera(C[0], C[1], 1, 1, rng.uniform(0.85, 1.15), f, rng.normal(0, 0.02) / 256**2, R, -R @ position, SIZE)


@given(st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_exact_points_in_space_give_the_camera_that_made_them(seed):
    camera = camera_at(seed)
    p = np.random.default_rng(seed).uniform(-1, 1, (16, 3))
    b = project(camera, p)
    pose = poses(p, b, 0.05, SIZE)[0]
    # the priors pull by far less than a tenth of a pixel
    assert np.linalg.norm(predicted(pose, p)[0] - b, axis=-1).max() < 0.1


def test_the_covariance_of_a_prediction_is_honest():
    camera, (_, p) = thesis_rig()[0], thesis_points()
    rng = np.random.default_rng(1)
    seeds = [0, 3, 12, 15, 17, 62]
    b = project(camera, p)
    squares = []
    for _ in range(12):
        pose = poses(p[seeds], b[seeds] + rng.normal(0, 1, (6, 2)), 1.0, SIZE)[0]
        at, covariance = predicted(pose, p)
        e = (at - b)[:, :, None]
        squares.append(np.median(np.swapaxes(e, 1, 2) @ np.linalg.inv(covariance) @ e))
    # chi-square with two degrees of freedom has median 1.4; the camera itself lies within its priors, which helps
    assert 0.1 < np.mean(squares) < 2.5


def test_a_plane_seen_from_afar_may_tip_either_way():
    camera = camera_at(3).with_(kappa1=0.0)
    p = np.array([[-0.3, -0.3, 0], [0.3, -0.3, 0], [0.3, 0.3, 0], [-0.3, 0.3, 0], [0.1, 0.0, 0]])
    found = starting_poses(p, project(camera, p), SIZE)
    normals = np.array([c.R @ [0, 0, 1] for c in found])
    assert np.ptp(np.arctan2(normals[:, 1], normals[:, 0])) > 0.5


def test_a_pinhole_camera_of_a_starting_focal_length_is_among_the_starts_wherever_the_origin_lies():
    shift = np.array([1000.0, -2000, 500])
    position = np.add(shift, (3, -4, 2))
    R = look_at(position, shift, roll_deg=20)
    camera = Camera(255.5, 239.5, 1, 1, 1, F_STARTS[1] * 512, 0.0, R, -R @ position, SIZE)
    p = np.random.default_rng(0).uniform(-0.5, 0.5, (9, 3)) + shift
    b = project(camera, p)
    off = [np.abs(project(start, p) - b).max() for start in starting_poses(p, b, SIZE)]
    assert min(off) < 1e-3
    assert sorted(off)[1] > 0.1


def test_a_start_behind_the_points_is_refused():
    camera, p = camera_at(0), np.random.default_rng(0).uniform(-1, 1, (8, 3))
    away = camera.with_(T=camera.T - [0, 0, 100])
    assert adjust(away, p, project(camera, p), 1.0) is None


def test_three_points_leave_the_lens_as_lenses_usually_are():
    camera, p = camera_at(4), np.random.default_rng(4).uniform(-1, 1, (3, 3))
    odd = camera.with_(Cx=camera.Cx + 60, Sx=1.3, kappa1=0.2 / 256**2)
    pose = adjust(odd, p, project(odd, p), 1.0, iterations=60)
    assert pose is not None
    assert np.abs(pose.residuals).max() < 0.1
    assert abs(pose.camera.Cx - 255.5) < 20  # from 60 away
    assert abs(np.log(pose.camera.Sx)) < 0.05
    assert abs(pose.camera.kappa1 * 256**2) < 0.05


def test_the_rich_lens_fits_what_the_plain_one_cannot():
    camera = camera_at(5).with_(kappa2=0.15 / 256**4, p1=0.01 / 256)
    p = np.random.default_rng(2).uniform(-1.2, 1.2, (60, 3))
    b = project(camera, p)
    plain = poses(p, b, 0.2, SIZE)[0]
    rich = adjust(plain.camera, p, b, 0.2, terms=RICH)
    assert rich is not None
    assert np.abs(rich.residuals).max() < 0.25 * np.abs(plain.residuals).max()
