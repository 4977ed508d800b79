"""Tsai's closed forms on exact points, on Willson's, and where the thesis's own would break."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from tests.geometry.test_camera import cameras
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form, plane_axes
from vidtrack.geometry.camera import distorted_from_frame_buffer, project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import thesis_points, thesis_rig

REAL = Path(__file__).parents[3] / "../shared/real/points"

some = settings(max_examples=30, deadline=None)


def seen_by(camera, p):
    return {"Cx": camera.Cx, "Cy": camera.Cy, "dx": camera.dx, "dy": camera.dy}, project(camera, p)


def cloud_before(camera, n=30, seed=0):
    """Points in front of a camera, well inside its picture, half as deep as far."""
    rng = np.random.default_rng(seed)
    tangent = 0.3 * 480 * camera.dy / camera.f
    c = np.stack([rng.uniform(-tangent, tangent, n), rng.uniform(-tangent, tangent, n), np.ones(n)], -1)
    return camera.position + (c * rng.uniform(100, 150, (n, 1))) @ camera.R


@some
@given(cameras())
def test_exact_points_give_the_exact_camera(camera):
    camera = camera.without_lens().with_(kappa1=camera.kappa1, projection="perspective")
    p = cloud_before(camera)
    known, b = seen_by(camera, p)
    found = camera_from_closed_form(closed_form(p, b, **known), camera.image_size)
    for name in ("Sx", "f"):
        assert getattr(found, name) == pytest.approx(getattr(camera, name), rel=1e-5), name
    np.testing.assert_allclose(found.R, camera.R, atol=1e-6)
    np.testing.assert_allclose(project(found, p), b, atol=1e-4)


def test_the_answer_does_not_depend_on_where_the_world_s_origin_lies():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    b = b + np.random.default_rng(0).normal(0, 0.1, b.shape)
    near, far = (closed_form(p + shift, b, **known) for shift in (0.0, 10_000.0))
    np.testing.assert_allclose(far.f, near.f, rtol=1e-8)
    np.testing.assert_allclose(far.R, near.R, atol=1e-8)
    np.testing.assert_allclose(far.T + far.R @ np.full(3, 10_000.0), near.T, atol=1e-6)


def test_an_origin_on_the_optical_axis_is_no_trouble():
    """Ty = 0 divides by nothing here; seven unknowns over Ty would (85 to 200 px in trials)."""
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    on_axis = camera.position + camera.R[2] * 160.0
    known, b = seen_by(camera, p)
    b = b + np.random.default_rng(1).normal(0, 0.1, b.shape)
    found = camera_from_closed_form(closed_form(p - on_axis, b, **known), camera.image_size)
    assert abs(found.T[1]) < 0.1
    assert 0.1 < np.sqrt(((project(found, p - on_axis) - b) ** 2).sum(1).mean()) < 0.2


def test_the_sense_of_the_axes_is_a_vote_of_all_points():
    """The farthest point, seen through the centre on the other side, lies on the same radial line: only the sense of
    the answer could suffer, were it that point's alone to tell."""
    camera = thesis_rig(1)[0].with_(kappa1=0.0)
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    centre = np.array([camera.Cx, camera.Cy])
    farthest = np.argmax(((b - centre) ** 2).sum(1))
    b[farthest] = 2 * centre - b[farthest]
    np.testing.assert_allclose(closed_form(p, b, **known).R, camera.R, atol=1e-6)


def test_the_thesis_s_Sx_is_found():
    """1.02 and not 1: the thesis's program drops it from Tx, Xd and the depth."""
    camera = thesis_rig(1)[0]
    known, b = seen_by(camera, thesis_points()[1])
    solution = closed_form(thesis_points()[1], b, **known)
    assert float(solution.Sx) == pytest.approx(camera.Sx, abs=1e-4)
    np.testing.assert_allclose(solution.T, camera.T, rtol=3e-4, atol=0.02)


def test_a_held_Sx_or_kappa1_is_held():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    assert float(closed_form(p, b, **known, Sx=1.0).Sx) == 1.0
    assert float(closed_form(p, b, **known, kappa1=0.0).kappa1) == 0.0
    assert float(closed_form(p, b, **known, kappa1=8e-4).f) == pytest.approx(camera.f, rel=1e-4)


def test_many_centres_in_one_call_are_many_calls():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    Cx = np.array([[250.0, 255.0], [260.0, 265.0]])
    all_ = closed_form(p, b, **{**known, "Cx": Cx})
    one = closed_form(p, b, **{**known, "Cx": 260.0})
    assert all_.R.shape == (2, 2, 3, 3)
    np.testing.assert_allclose(all_.f[1, 0], one.f, rtol=1e-6)
    np.testing.assert_allclose(all_.T[1, 0], one.T, rtol=1e-6)


def test_mirrored_axes_show_in_f_or_the_depths():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    solution = closed_form(p * [-1, 1, 1], b, **known)
    assert solution.f < 0 or (solution.depth < 0).all()


def test_six_points_are_too_few():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1][:6]
    known, b = seen_by(camera, p)
    with pytest.raises(ValueError, match="6 points; the noncoplanar method needs 7"):
        closed_form(p, b, **known)


@pytest.mark.parametrize("held", [None, 8e-4])
def test_f_depth_and_kappa1_are_what_scipy_makes_of_the_perspective_equations(held):
    """With R, Tx, Ty and Sx as found, f x / z = Xd (1 + kappa1 r^2) and the same for y, in least squares."""
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    known, b = seen_by(camera, p)
    b = b + np.random.default_rng(2).normal(0, 0.3, b.shape)
    s = closed_form(p, b, **known, kappa1=held)
    c = p @ s.R.T + [s.T[0], s.T[1], 0]
    d = distorted_from_frame_buffer(camera.with_(Sx=float(s.Sx)), b)

    def errors(x):
        kappa1 = x[2] / 1e3 if held is None else held
        return (x[0] * c[:, :2] / (c[:, 2:] + 10 * x[1]) - d * (1 + kappa1 * (d**2).sum(-1, keepdims=True))).ravel()

    start = [camera.f, camera.T[2] / 10, camera.kappa1 * 1e3][: 3 if held is None else 2]
    best = least_squares(errors, start, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    found = [float(s.f), float(s.T[2]) / 10, float(s.kappa1) * 1e3][: len(best)]
    np.testing.assert_allclose(found, best, rtol=1e-5)
    np.testing.assert_allclose(s.depth, c[:, 2] + s.T[2], rtol=1e-12)


def plane_before(camera, tilt_deg, columns=7, rows=6):
    """A plane of points 160 units in front of a camera, turned about the camera's x axis."""
    x, y = np.meshgrid(np.linspace(-20, 20, columns), np.linspace(-15, 15, rows))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], -1)
    a = np.radians(tilt_deg)
    around_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    return camera.position + (flat @ around_x.T + [0, 0, 160]) @ camera.R


@pytest.mark.parametrize("tilt", [20.0, 45.0, -60.0])
@pytest.mark.parametrize("Sx", [None, 1.02])
def test_one_tilted_plane_gives_the_camera_when_Sx_is_1_or_given(tilt, Sx):
    camera = thesis_rig(1)[0].with_(Sx=Sx or 1.0)
    p = plane_before(camera, tilt)
    known, b = seen_by(camera, p)
    solution = closed_form(p, b, **known, Sx=Sx, coplanar=True)
    np.testing.assert_allclose(solution.R, camera.R, atol=2e-3)
    assert float(solution.f) == pytest.approx(camera.f, rel=2e-3)
    found = camera_from_closed_form(solution, camera.image_size)
    np.testing.assert_allclose(project(found, p), b, atol=0.05)


@some
@given(st.floats(0, 360), st.floats(15, 65), st.floats(0, 360), st.floats(-8, 8), st.floats(-6, 6))
def test_a_plane_tilted_about_any_line_gives_the_exact_camera(axis, tilt, turn, aside, up):
    """Without a lens the closed form is exact: tilted obliquely, turned in its own plane, and off the axis."""
    camera = thesis_rig(1)[0].with_(Sx=1.0, kappa1=0.0)
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(-20, 20, 12), rng.uniform(-15, 15, 12), np.zeros(12)])
    about = np.radians(tilt) * np.array([np.cos(np.radians(axis)), np.sin(np.radians(axis)), 0.0])
    R = rotation_from_vector(about) @ rotation_from_vector([0, 0, np.radians(turn)])
    p = camera.position + (flat @ R.T + [aside, up, 160]) @ camera.R
    known, b = seen_by(camera, p)
    found = camera_from_closed_form(closed_form(p, b, **known, coplanar=True), camera.image_size)
    np.testing.assert_allclose(found.R, camera.R, atol=1e-6)
    np.testing.assert_allclose(found.T, camera.T, rtol=1e-5, atol=1e-4)
    assert found.f == pytest.approx(camera.f, rel=1e-5)


def test_a_search_over_centres_takes_for_each_the_pose_with_a_positive_f():
    """The mirror image of the pose fits the directions in the picture as well; its f is negative."""
    camera = thesis_rig(1)[0].with_(Sx=1.0)
    Cx = camera.Cx + np.array([[-2.0, 0.0, 2.0]])
    for tilt in (30.0, -30.0):
        p = plane_before(camera, tilt)
        known, b = seen_by(camera, p)
        found = closed_form(p, b, **{**known, "Cx": Cx}, coplanar=True)
        assert found.f.shape == (1, 3)
        np.testing.assert_allclose(found.f, camera.f, rtol=0.05)
        np.testing.assert_allclose(found.R[0, 1], camera.R, atol=2e-3)
        assert (found.depth > 0).all()


def test_points_that_settle_no_camera_make_none_and_no_exception():
    same = np.tile([[1.0, 2.0, 3.0]], (8, 1))
    line = np.arange(8.0)[:, None] * [1.0, 2.0, 3.0]
    for p in (same, line):
        b = np.stack([np.arange(8.0), np.zeros(8)], -1)
        solution = closed_form(p, b, Cx=3.0, Cy=0.0, dx=1.0, dy=1.0)
        with pytest.raises(ValueError):
            camera_from_closed_form(solution, (64, 48))


def test_four_points_are_too_few_for_a_plane():
    with pytest.raises(ValueError, match="4 points; the coplanar method needs 5"):
        closed_form(np.zeros((4, 3)), np.zeros((4, 2)), Cx=0, Cy=0, dx=1, dy=1, coplanar=True)


def test_plane_axes_are_a_rotation_with_the_normal_last():
    q = np.random.default_rng(0).normal(size=(20, 3)) * [3, 2, 0]
    axes = plane_axes(q - q.mean(0))
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(np.abs(axes[2]), [0, 0, 1], atol=1e-12)


@pytest.mark.skipif(not REAL.exists(), reason="needs ../shared/real")
def test_willson_s_points_in_closed_form():
    """Willson's own code leaves .112 px at the nominal centre."""
    t = np.genfromtxt(REAL / "willson_ncc/cam1.csv", delimiter=",", skip_header=1)
    p, b = t[:, 1:4], t[:, 4:6]
    found = camera_from_closed_form(closed_form(p, b, Cx=258, Cy=204, dx=0.023, dy=0.023), (576, 384))
    assert 0.0894 < np.sqrt(((project(found, p) - b) ** 2).sum(1).mean()) <= 0.112
