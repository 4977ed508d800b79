"""A camera of ours sees as the lens of another program does, to within what is stated."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.geometry.test_brown import MILD, RICH, SIZE, WIDE, by_opencv, seen_by
from vidtrack.geometry.brown import BrownLens, distorted, undistorted
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.lens_conversion import brown_from_camera, camera_from_brown, inner_covariance


@pytest.mark.parametrize("lens", [MILD, WIDE, RICH])
def test_the_converted_camera_sees_as_opencv_does(lens):
    done = camera_from_brown(lens)
    off = np.linalg.norm(project(done.camera, seen_by(lens)) - by_opencv(lens, seen_by(lens)), axis=-1)
    assert off.max() <= 1.05 * done.largest_px + 1e-9
    assert done.largest_px < 0.05
    assert done.covered == 1


def test_the_plainest_model_that_is_near_enough_is_taken():
    assert camera_from_brown(MILD._replace(k=(-1e-5,), p1=0.0, p2=0.0)).model == "tsai"
    assert camera_from_brown(MILD._replace(k=(-0.08, 0.02), p1=0.0, p2=0.0)).model in ("tsai2", "tsai3")
    assert camera_from_brown(WIDE).model == "fisheye"
    assert camera_from_brown(MILD._replace(skew=0.8)).camera.skew == pytest.approx(0.8 / 1395, rel=0.05)


def test_a_lens_without_terms_keeps_its_numbers():
    camera = camera_from_brown(BrownLens(1400.0, 1390.0, 600.0, 300.0, SIZE), dx=0.004, dy=0.005).camera
    assert (camera.Cx, camera.Cy, camera.f) == pytest.approx((600, 300, 1390 * 0.005))
    assert camera.Sx * camera.f / camera.dx == pytest.approx(1400)
    assert camera.kappa1 == pytest.approx(0, abs=1e-12)


def test_a_sensor_changes_the_unit_and_no_pixel():
    px, mm = camera_from_brown(MILD).camera, camera_from_brown(MILD, dx=0.004, dy=0.004).camera
    p = seen_by(MILD)
    np.testing.assert_allclose(project(mm, p), project(px, p), atol=1e-6)


def test_where_the_lens_turns_the_camera_its_centre_stays():
    """Decentring with strong distortion shifts the principal point; a turn about the centre makes up for it."""
    R = cv2.Rodrigues(np.array([0.3, -0.5, 0.1]))[0]
    T = np.array([1.0, -2.0, 30.0])
    lens = MILD._replace(k=(-0.25, 0.12), p1=2e-3, p2=-3e-3)
    placed, alone = camera_from_brown(lens, R=R, T=T), camera_from_brown(lens)
    np.testing.assert_allclose(placed.camera.position, -R.T @ T, atol=1e-9)
    c = seen_by(lens)
    np.testing.assert_allclose(project(placed.camera, (c - T) @ R), project(alone.camera, c), atol=1e-6)


def test_strong_decentring_leaves_less_where_centre_and_turn_may_move():
    lens = MILD._replace(k=(-0.25, 0.12), p1=2e-3, p2=-3e-3)
    assert camera_from_brown(lens).largest_px < 0.15
    assert camera_from_brown(lens).camera.Cx != lens.cx


@settings(max_examples=15, deadline=None)
@given(st.floats(-0.15, 0.15), st.floats(-0.05, 0.05), st.floats(-5e-4, 5e-4), st.floats(-5e-4, 5e-4))
def test_there_and_back_is_the_lens_again(k1, k2, p1, p2):
    lens = MILD._replace(k=(k1, k2), p1=p1, p2=p2)
    there = camera_from_brown(lens)
    back = brown_from_camera(there.camera)
    x = undistorted(lens, np.array([[100.0, 100.0], [1200.0, 650.0], [640.0, 100.0], [20.0, 360.0]]))
    around = project(there.camera, np.concatenate([x, np.ones((4, 1))], -1))
    seen = np.concatenate([x, np.ones((4, 1))], -1) @ there.camera.R.T
    np.testing.assert_allclose(distorted(back.lens, seen[:, :2] / seen[:, 2:]), around, atol=back.largest_px + 1e-6)
    assert back.largest_px < 0.8  # the more, the stronger the lens: it is stated


def test_a_wide_camera_becomes_a_fisheye_lens_and_its_error_is_stated():
    camera = camera_from_brown(WIDE).camera
    back = brown_from_camera(camera, radial=4)
    assert back.lens.fisheye
    p = seen_by(WIDE)
    off = np.linalg.norm(by_opencv(back.lens, p) - project(camera, p), axis=-1).max()
    assert off <= 1.05 * back.largest_px + 1e-9 < 0.01


def test_a_lens_that_folds_in_the_picture_says_how_much_of_it_is_seen():
    assert camera_from_brown(MILD._replace(fx=700.0, fy=700.0, k=(-0.5, 0.0, 0.0))).covered < 1


@pytest.mark.parametrize("lens", [MILD._replace(fx=-1.0), MILD._replace(k=(-900.0,))])
def test_what_is_no_lens_is_refused(lens):
    with pytest.raises(ValueError):
        camera_from_brown(lens)


def test_standard_deviations_are_carried_over():
    """1 px in fx and fy together is 1 px in f; k1 moves kappa1 by -1/f^2; cx moves Cx."""
    lens = BrownLens(1400.0, 1400.0, 640.0, 360.0, SIZE, (-0.01,))
    names, C = inner_covariance(lens, {"fy": 1.0, "cx": 2.0, "k1": 0.01}, "tsai2")
    sd = dict(zip(names, np.sqrt(np.diag(C)), strict=True))
    assert sd["f"] == pytest.approx(1.0, rel=0.01)
    assert sd["Sx"] == pytest.approx(1 / 1400, rel=0.01)
    assert sd["Cx"] == pytest.approx(2.0, rel=0.01)
    assert sd["Cy"] < 0.01
    assert sd["kappa1"] == pytest.approx(0.01 / 1400**2, rel=0.1)


def test_a_number_that_the_lens_has_not_is_refused():
    with pytest.raises(ValueError, match="k9"):
        inner_covariance(MILD, {"k9": 0.1}, "tsai2")


def test_a_camera_of_ours_keeps_its_name_and_size():
    camera = camera_from_brown(MILD, name="cam7").camera
    assert isinstance(camera, Camera)
    assert (camera.name, camera.image_size) == ("cam7", SIZE)
