"""The camera model: every arrow against its definition, against its inverse, and at its edges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    contains,
    distorted_from_frame_buffer,
    distorted_from_undistorted,
    fold_radius,
    frame_buffer_from_distorted,
    line_of_sight,
    project,
    undistorted_from_camera,
    undistorted_from_distorted,
    undistorted_jacobian,
    units_per_px,
)
from vidtrack.geometry.lens_terms import COEFFICIENTS, LENS_MODELS, RICHEST, TERMS
from vidtrack.geometry.rotation import rotation_from_vector

DX, DY = 8.8 / 512, 6.6 / 480


def straight_on(**changes):
    """A camera at the world's origin that looks along z, f = 10 mm, without distortion."""
    camera = Camera(255.5, 239.5, DX, DY, 1.0, 10.0, 0.0, np.eye(3), np.zeros(3), (512, 480))
    return camera.with_(**changes)


@st.composite
def cameras(draw):
    """Any camera a laboratory may own: barrel or pincushion, tilted, off centre, some with the richer lens terms."""
    u = lambda low, high: round(draw(st.floats(low, high)), 12)  # noqa: E731
    rich, wide = draw(st.booleans()), draw(st.booleans())
    return straight_on(
        Cx=255.5 + u(-30, 30),
        Cy=239.5 + u(-30, 30),
        Sx=u(0.8, 1.25),
        f=u(6, 60),
        kappa1=u(-2e-3, 2e-3),
        kappa2=u(-1e-5, 1e-5) if rich else 0.0,
        p1=u(-3e-4, 3e-4) if rich else 0.0,
        p2=u(-3e-4, 3e-4) if rich else 0.0,
        skew=u(-5e-3, 5e-3) if rich else 0.0,
        kappa3=u(-1e-8, 1e-8) if rich else 0.0,
        s1=u(-3e-4, 3e-4) if rich else 0.0,
        s2=u(-3e-4, 3e-4) if rich else 0.0,
        q1=u(-3e-4, 3e-4) if rich else 0.0,
        q2=u(-3e-4, 3e-4) if rich else 0.0,
        projection="equidistant" if wide else "perspective",
        R=rotation_from_vector([u(-3, 3), u(-3, 3), u(-3, 3)]),
        T=np.array([u(-50, 50), u(-50, 50), u(50, 500)]),
    )


def test_a_row_of_the_picture_spans_what_two_points_that_far_apart_show():
    camera = straight_on()
    p = np.array([[3.0, -2.0, 100.0], [3.0, -2.0, 250.0]])
    spans = units_per_px(camera, p)
    beside = p + np.array([0.0, 1.0, 0.0]) * spans[:, None]
    assert project(camera, beside) - project(camera, p) == pytest.approx(np.array([[0.0, 1.0]] * 2), abs=1e-9)


pixels = st.tuples(st.floats(0, 511), st.floats(0, 479)).map(np.array)
some = settings(max_examples=50, deadline=None)


def test_a_point_on_the_optical_axis_falls_on_Cx_Cy():
    np.testing.assert_array_equal(project(straight_on(kappa1=1e-3), [0, 0, 7.0]), [255.5, 239.5])


def test_one_unit_aside_at_ten_units_depth_is_f_over_ten_on_the_sensor():
    # Xu = 10 mm * 1/10 = 1 mm, hence 1/dx = 58.18 columns right, 1/dy = 72.73 rows down
    np.testing.assert_allclose(project(straight_on(), [1.0, 1.0, 10.0]), [255.5 + 512 / 8.8, 239.5 + 480 / 6.6])


def test_Sx_stretches_columns_and_not_rows():
    np.testing.assert_allclose(
        project(straight_on(Sx=1.02), [1, 1, 10.0]), [255.5 + 1.02 * 512 / 8.8, 239.5 + 480 / 6.6]
    )


def test_distortion_acts_from_distorted_to_undistorted():
    # Rd = 2 with kappa1 = 0.01: Ru = 2 (1 + 0.04) = 2.08
    camera = straight_on(kappa1=0.01)
    np.testing.assert_allclose(undistorted_from_distorted(camera, [0.0, 2.0]), [0, 2.08])
    np.testing.assert_allclose(distorted_from_undistorted(camera, [0.0, 2.08]), [0, 2.0], rtol=1e-15)


def test_decentring_on_paper():
    # d = (1, 2), p1 = .01: Xu += .01 (5 + 2), Yu += 2 * .01 * 2; p2 = .01: Xu += 2 * .01 * 2, Yu += .01 (5 + 8)
    one, two = straight_on(p1=0.01), straight_on(p2=0.01)
    np.testing.assert_allclose(undistorted_from_distorted(one, [1.0, 2.0]), [1.07, 2.04])
    np.testing.assert_allclose(undistorted_from_distorted(two, [1.0, 2.0]), [1.04, 2.13])


def test_skew_shifts_columns_by_the_row():
    camera = straight_on(skew=0.01)
    np.testing.assert_allclose(frame_buffer_from_distorted(camera, [0.0, 1.0])[0], 255.5 + 0.01 / DX)


@some
@given(cameras(), pixels)
def test_the_lens_inverts_to_the_last_digits(camera, b):
    d = distorted_from_frame_buffer(camera, b)
    u = undistorted_from_distorted(camera, d)
    if np.isfinite(u).all():
        np.testing.assert_allclose(distorted_from_undistorted(camera, u), d, rtol=1e-9, atol=1e-11)


@some
@given(cameras(), pixels)
def test_frame_buffer_and_sensor_are_inverse(camera, b):
    np.testing.assert_allclose(
        frame_buffer_from_distorted(camera, distorted_from_frame_buffer(camera, b)), b, atol=1e-9
    )


@some
@given(cameras(), pixels, st.floats(1, 1000))
def test_every_point_of_a_line_of_sight_projects_to_its_pixel(camera, b, far):
    origin, direction = line_of_sight(camera, b)
    if np.isfinite(direction).all():
        np.testing.assert_allclose(project(camera, origin + far * direction), b, atol=1e-6)
        assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-12)


@some
@given(cameras(), st.integers(-10000, 10000))
def test_moving_world_and_camera_together_changes_nothing(camera, shift):
    p = camera.position + camera.R.T @ np.array([1.0, -2.0, 30.0])
    moved = camera.with_(T=camera.T - camera.R @ np.full(3, float(shift)))
    np.testing.assert_allclose(project(moved, p + shift), project(camera, p), atol=1e-6, equal_nan=True)


@some
@given(st.floats(-1e-4, 1e-4))
def test_near_zero_kappa1_the_inverse_keeps_full_precision(kappa1):
    camera = straight_on(kappa1=kappa1)
    d = np.array([[3.0, -2.0], [0.1, 0.2], [1e-9, 0]])
    np.testing.assert_allclose(distorted_from_undistorted(camera, undistorted_from_distorted(camera, d)), d, rtol=4e-15)


def test_a_barrel_folds_where_its_slope_ends():
    # 1 + 3 kappa1 Rd^2 = 0 at Rd = sqrt(1 / 0.03) = 5.77; there Ru = 2/3 Rd
    camera = straight_on(kappa1=-0.01)
    fold = fold_radius(camera)
    assert fold == pytest.approx(5.7735, abs=1e-4)
    assert undistorted_from_distorted(camera, [fold, 0.0])[0] == pytest.approx(2 / 3 * fold)
    assert np.isnan(undistorted_from_distorted(camera, [fold + 1e-6, 0])).all()
    assert np.isnan(distorted_from_undistorted(camera, [2 / 3 * fold + 1e-6, 0])).all()
    assert np.isfinite(distorted_from_undistorted(camera, [2 / 3 * fold - 1e-6, 0])).all()


def test_a_pincushion_never_folds():
    assert fold_radius(straight_on(kappa1=0.01)) == np.inf


def test_kappa2_can_unfold_what_kappa1_folds():
    # 1 - 0.03 s + 5 k2 s^2 has no root when k2 > 0.03^2 / 20
    assert fold_radius(straight_on(kappa1=-0.01, kappa2=4.6e-5)) == np.inf
    assert np.isfinite(fold_radius(straight_on(kappa1=-0.01, kappa2=4.4e-5)))


@pytest.mark.parametrize("kappa2", [1e-300, -1e-300, 5e-324])
def test_a_vanishing_kappa2_folds_where_kappa1_alone_does(kappa2):
    assert fold_radius(straight_on(kappa1=-0.01, kappa2=kappa2)) == pytest.approx(5.7735, abs=1e-4)
    assert fold_radius(straight_on(kappa1=0.01, kappa2=abs(kappa2))) == np.inf


def test_each_lens_term_has_the_slope_of_its_shift():
    x, y = np.random.default_rng(0).uniform(-4, 4, (2, 20))
    h = 1e-6

    def shift(term, x, y):
        return np.stack(np.broadcast_arrays(*term.shift(x, y, x * x + y * y)))

    for term in TERMS.values():
        by_x = (shift(term, x + h, y) - shift(term, x - h, y)) / (2 * h)
        by_y = (shift(term, x, y + h) - shift(term, x, y - h)) / (2 * h)
        slopes = np.stack(np.broadcast_arrays(*term.slope(x, y, x * x + y * y)))
        np.testing.assert_allclose(slopes, [by_x[0], by_y[0], by_x[1], by_y[1]], rtol=1e-6, atol=1e-6)


def test_every_lens_term_is_a_parameter_of_the_camera_and_belongs_to_the_richest_model():
    assert set(COEFFICIENTS) == {*TERMS, "skew"} == set(LENS_MODELS[RICHEST])
    assert all(getattr(straight_on(), name) == 0 for name in COEFFICIENTS)


def test_kappa3_folds_where_the_cubic_in_r_squared_has_its_first_root():
    # 1 + 7 kappa3 r^6 = 0 at r = 2: kappa3 = -1 / 448; with kappa1 = 1 / 3: 1 + s - 7 k s^3, s = 2 at k = 3 / 56
    assert fold_radius(straight_on(kappa3=-1 / 448)) == pytest.approx(2)
    assert fold_radius(straight_on(kappa1=1 / 3, kappa3=-3 / 56)) == pytest.approx(np.sqrt(2))
    assert fold_radius(straight_on(kappa3=1e-6)) == np.inf


def test_a_thin_prism_shifts_by_r_squared():
    # d = (1, 2): r^2 = 5
    camera = straight_on(s1=0.01, s2=0.02)
    np.testing.assert_allclose(undistorted_from_distorted(camera, [1.0, 2.0]), [1.05, 2.1])


def test_kappa2_alone_folds_at_the_fourth_root():
    # 1 + 5 k2 Rd^4 = 0
    assert fold_radius(straight_on(kappa2=-2e-4)) == pytest.approx(1000**0.25)


@pytest.mark.filterwarnings("error")
def test_the_axis_of_a_lens_that_folds_is_its_middle_and_no_division_by_zero():
    camera = straight_on(kappa1=-0.01, kappa2=1e-5)
    assert np.isfinite(fold_radius(camera))
    b = project(camera, [[0, 0, 10.0], [0.1, 0, 10.0]])
    np.testing.assert_array_equal(b[0], [camera.Cx, camera.Cy])
    assert b[1, 0] > camera.Cx


def test_a_point_behind_the_camera_is_nowhere():
    camera = straight_on()
    assert np.isnan(project(camera, [[0, 0, -1.0], [0, 0, 0.0]])).all()


def test_nan_stays_nan_and_spoils_nothing_else():
    b = project(straight_on(kappa1=1e-3, kappa2=1e-6), [[np.nan, 0, 5], [1, 0, 10.0]])
    assert np.isnan(b[0]).all()
    assert np.isfinite(b[1]).all()


def test_any_leading_axes_pass_through():
    p = np.random.default_rng(0).uniform(1, 2, (2, 3, 4, 3))
    b = project(straight_on(), p)
    assert b.shape == (2, 3, 4, 2)
    np.testing.assert_allclose(b[1, 2, 3], project(straight_on(), p[1, 2, 3]))


def test_camera_coordinates_are_R_p_plus_T():
    R = rotation_from_vector([0, 0, np.pi / 2])  # x to y
    camera = straight_on(R=R, T=np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(camera_from_world(camera, [1.0, 0, 0]), [1, 3, 3], atol=1e-15)
    np.testing.assert_allclose(camera_from_world(camera, camera.position), 0, atol=1e-15)


def test_a_mirror_is_no_rotation():
    with pytest.raises(ValueError, match="right-handed"):
        straight_on(R=np.diag([1.0, 1.0, -1.0]))


@pytest.mark.parametrize("name", ["f", "dx", "dy", "Sx"])
def test_lengths_must_be_positive(name):
    with pytest.raises(ValueError, match="positive"):
        straight_on(**{name: -1.0})


def test_a_camera_cannot_be_changed_through_its_arrays():
    camera = straight_on()
    with pytest.raises(ValueError, match="read-only"):
        camera.R[0, 0] = 2


def test_the_picture_reaches_half_a_pixel_beyond_its_outer_centres():
    b = [[-0.5, -0.5], [511.5, 479.5], [-0.51, 0], [0, 479.51]]
    np.testing.assert_array_equal(contains(straight_on(), b), [True, True, False, False])


@some
@given(cameras())
def test_the_lens_slope_is_that_of_finite_differences(camera):
    d, h = np.array([1.3, -0.9]), 1e-6
    step = np.eye(2) * h
    numeric = np.stack(
        [
            (undistorted_from_distorted(camera, d + s) - undistorted_from_distorted(camera, d - s)) / (2 * h)
            for s in step
        ],
        -1,
    )
    np.testing.assert_allclose(undistorted_jacobian(camera, d), numeric, atol=1e-8)


def test_opencv_sees_the_same_where_both_models_agree():
    """Outside witness: without distortion Tsai's camera is OpenCV's with fx = Sx f / dx, fy = f / dy."""
    cv2 = pytest.importorskip("cv2")
    R = rotation_from_vector([0.3, -0.2, 0.5])
    camera = straight_on(Sx=1.03, R=R, T=np.array([1.0, -2.0, 60.0]))
    p = np.random.default_rng(1).uniform(-10, 10, (20, 3))
    K = np.array([[1.03 * 10 / DX, 0, 255.5], [0, 10 / DY, 239.5], [0, 0, 1]])
    theirs = cv2.projectPoints(p, cv2.Rodrigues(R)[0], camera.T, K, None)[0][:, 0]
    np.testing.assert_allclose(project(camera, p), theirs, atol=1e-9)


def test_the_perspective_needs_a_depth():
    np.testing.assert_allclose(undistorted_from_camera(straight_on(), [2.0, -4.0, 8.0]), [2.5, -5.0])


def test_many_lines_of_sight_are_unit_vectors_each_through_its_own_point():
    camera = straight_on(kappa1=1e-3, R=rotation_from_vector([0.3, -0.4, 0.5]), T=np.array([1.0, 2, 90]))
    p = camera.position + np.random.default_rng(0).uniform([-20, -20, 80], [20, 20, 120], (4, 3, 3)) @ camera.R
    centre, direction = line_of_sight(camera, project(camera, p))
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1, rtol=1e-12)
    along = (p - centre) / np.linalg.norm(p - centre, axis=-1, keepdims=True)
    np.testing.assert_allclose(direction, along, atol=1e-9)
