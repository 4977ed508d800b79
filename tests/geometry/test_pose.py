"""A camera from a few points predicts where the others are, and knows how well."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import PARAMETERS, stepped
from vidtrack.geometry.pose import F_STARTS, PLAIN, RICH, adjust, poses, predicted, starting_poses
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


def documented_cost(camera, p, b, sd):
    """Huber's cost of each point's length off, and what is assumed of cameras: f 1.5 pictures wide within a factor e,
    square pixels within 15 %, the axis in the middle within 12 % of the width, distortion 0.1 at the side."""
    off = np.linalg.norm(b - project(camera, p), axis=1) / sd
    huber = np.where(off < 2.5, off**2 / 2, 2.5 * off - 2.5**2 / 2)
    width, height = camera.image_size
    priors = [
        np.log(camera.f / (1.5 * width)) / 1.0,
        np.log(camera.Sx) / 0.15,
        (camera.Cx - (width - 1) / 2) / (0.12 * width),
        (camera.Cy - (height - 1) / 2) / (0.12 * width),
        camera.kappa1 * (width / 2) ** 2 / 0.1,
    ]
    return huber.sum() + np.square(priors).sum() / 2


def varied(pose, name, step):
    if name in ("f", "Sx"):
        return pose.camera.with_(**{name: getattr(pose.camera, name) * np.exp(step)})
    return stepped(pose.camera, pose.pivot, {name: step * (256.0**-2 if name == "kappa1" else 1.0)})


def fitted(seed, outlier):
    camera = camera_at(seed)
    rng = np.random.default_rng(seed)
    p = rng.uniform(-1, 1, (20, 3))
    b = project(camera, p) + rng.normal(0, 0.5, (20, 2))
    b[3] += outlier
    return camera, p, b, adjust(camera, p, b, 0.5, iterations=60)


@pytest.mark.parametrize("outlier", [0.0, 30.0])
@pytest.mark.parametrize("seed", [0, 6])
def test_the_pose_has_the_least_cost_of_those_about_it(seed, outlier):
    _, p, b, pose = fitted(seed, outlier)
    assert pose.cost == pytest.approx(documented_cost(pose.camera, p, b, 0.5), rel=1e-9)
    for k, name in enumerate(PARAMETERS[:PLAIN]):
        sd = np.sqrt(pose.covariance[k, k])
        for step in (0.3 * sd, -0.3 * sd):
            assert documented_cost(varied(pose, name, step), p, b, 0.5) > pose.cost, name


def test_the_covariance_is_the_inverse_of_the_curvature_of_the_cost():
    _, p, b, pose = fitted(6, 0.0)
    information = np.linalg.inv(pose.covariance)
    for k, name in enumerate(PARAMETERS[:PLAIN]):
        h = 0.3 / np.sqrt(information[k, k])
        ends = [documented_cost(varied(pose, name, step), p, b, 0.5) for step in (h, -h)]
        assert (sum(ends) - 2 * pose.cost) / h**2 == pytest.approx(information[k, k], rel=0.1), name


def test_one_point_far_off_hardly_moves_the_others():
    camera, p, _, pose = fitted(0, 30.0)
    others = np.arange(20) != 3
    assert np.abs(predicted(pose, p)[0] - project(camera, p))[others].max() < 1.5


def test_poses_that_are_alike_are_one_and_a_plane_s_two_are_two():
    camera = camera_at(3).with_(kappa1=0.0)
    p = np.array([[-0.3, -0.3, 0], [0.3, -0.3, 0], [0.3, 0.3, 0], [-0.3, 0.3, 0], [0.1, 0.0, 0]])
    found = poses(p, project(camera, p), 1.0, SIZE)
    for i, one in enumerate(found):
        for other in found[:i]:
            turn = Rotation.from_matrix(one.camera.R @ other.camera.R.T).magnitude()
            assert turn > 0.1 or abs(np.log(one.camera.f / other.camera.f)) > 0.4
    assert len(poses(np.random.default_rng(0).uniform(-1, 1, (16, 3)), *seen_exactly(), SIZE)) == 1


def seen_exactly():
    return project(camera_at(0), np.random.default_rng(0).uniform(-1, 1, (16, 3))), 0.5
