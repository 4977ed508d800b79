"""What a run's picture shows of the calibration's, and the camera as that picture has it."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, derivatives
from vidtrack.geometry.picture_part import Picture, Window, picture_from_record, window
from vidtrack.simulate.rig import thesis_rig

HERE = {"camera": "cam1", "where": "runs.r1"}


def test_the_middle_of_the_first_of_two_by_two_pixels_is_a_quarter_pixel_off_the_corner_pixels_middle():
    half = Window(0, 0, 640, 480, 320, 240)
    assert half.seen([[0.5, 0.5], [0, 0], [639, 479]]) == pytest.approx(
        np.array([[0, 0], [-0.25, -0.25], [319.25, 239.25]])
    )


def test_a_cut_out_part_at_full_size_moves_the_origin_by_whole_pixels():
    assert Window(100, 60, 400, 300, 400, 300).seen([100.0, 60.0]) == pytest.approx([0, 0])


@given(
    st.floats(-200, 200),
    st.floats(-200, 200),
    st.floats(50, 2000),
    st.floats(50, 2000),
    st.integers(1, 4000),
    st.integers(1, 4000),
)
def test_what_the_changed_camera_projects_is_what_the_window_shows_of_the_picture(left, top, w, h, columns, rows):
    shown = Window(left, top, w, h, columns, rows)
    camera = thesis_rig(2)[0].with_(kappa1=1e-3, skew=0.01)
    p = np.array([[0.0, 1, 2], [10, -3, 4], [-20, 5, 0]])
    b = project(camera, p)
    np.testing.assert_allclose(project(shown.camera(camera), p), shown.seen(b), rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(shown.back(shown.seen(b)), b, rtol=1e-9, atol=1e-6)


def test_the_covariance_gives_pixels_of_the_new_picture():
    """d(px)/d(parameters) C its transpose is the sight's covariance; it scales with the picture."""
    shown = Window(40, 20, 320, 400, 640, 400)
    camera = thesis_rig(2)[0]
    names = ("omega_x", "f", "Cx", "Cy")
    root = np.random.default_rng(1).normal(size=(4, 4)) * [1e-4, 1e-2, 0.3, 0.2]
    C = root.T @ root
    which = [PARAMETERS.index(name) for name in names]
    p, pivot = np.array([[3.0, 1, 2]]), np.zeros(3)
    J = derivatives(camera, p, pivot).by_parameter[0][:, which] * shown.scale[:, None]
    K = derivatives(shown.camera(camera), p, pivot).by_parameter[0][:, which]
    np.testing.assert_allclose(K @ shown.covariance(names, C) @ K.T, J @ C @ J.T, rtol=1e-9)


def test_a_picture_of_the_same_size_is_the_same_picture():
    assert window(Picture(640, 480), Picture(640, 480), **HERE) == (None, [])


@pytest.mark.parametrize("size", [(320, 240), (1280, 960), (854, 640), (853, 640)])
def test_the_same_shape_is_taken_for_the_whole_picture_and_that_is_said(size):
    shown, found = window(Picture(640, 480), Picture(*size), **HERE)
    assert shown == Window(0, 0, 640, 480, *size)
    assert [(f.level, f.code) for f in found] == [("doubtful", "picture-scaled")]
    assert "640 x 480" in found[0].text
    assert "crop: [0, 0, 640, 480]" in found[0].cure


def test_pixels_that_are_not_square_are_stretched_to_the_same_shape():
    shown, _ = window(Picture(1920, 1080), Picture(1440, 1080, Fraction(4, 3)), **HERE)
    assert shown.scale == pytest.approx([0.75, 1])


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ((640, 360), r"another shape.*\[0, 60, 640, 360\]"),
        ((1280, 720), r"another shape.*\[0, 60, 640, 360\]"),
        ((480, 640), "turned by a quarter"),
        ((640, 240), "single fields"),
        ((640, 488), "another shape"),
    ],
)
def test_another_shape_is_refused_with_what_it_may_be(size, said):
    with pytest.raises(VidtrackError, match=rf"^runs\.r1: cam1 shows {size[0]} x {size[1]} px .*640 x 480.*{said}"):
        window(Picture(640, 480), Picture(*size), **HERE)


def test_a_crop_is_believed_and_says_nothing_where_the_shapes_agree():
    shown, found = window(Picture(640, 480), Picture(1280, 720), [0, 60, 640, 360], **HERE)
    assert (shown, found) == (Window(0, 60, 640, 360, 1280, 720), [])
    assert window(Picture(640, 480), Picture(320, 240), [0, 0, 640, 480], **HERE)[1] == []
    assert window(Picture(640, 480), Picture(640, 480), [0, 0, 640, 480], **HERE) == (None, [])


def test_a_crop_of_another_shape_than_the_picture_is_doubted():
    _, found = window(Picture(640, 480), Picture(640, 480), [0, 60, 640, 360], **HERE)
    assert [f.code for f in found] == ["crop-of-another-shape"]


def test_a_picture_on_its_head_by_its_flag_alone_is_bad():
    _, found = window(Picture(640, 480), Picture(640, 480, rotation=180), **HERE)
    assert [(f.level, f.code) for f in found] == [("bad", "rotation-differs")]


def test_pixels_of_two_shapes_are_two_modes_of_a_camera():
    normal, wide = Picture(720, 480, Fraction(8, 9)), Picture(720, 480, Fraction(32, 27))
    with pytest.raises(VidtrackError, match=r"shape 32:27 and was calibrated with 8:9.*crop"):
        window(normal, wide, **HERE)
    assert window(normal, wide, (0, 0, 720, 480), **HERE) == (None, [])
    part, found = window(normal, Picture(720, 480), **HERE)
    assert part is None
    assert [(f.level, f.code) for f in found] == [("doubtful", "pixel-shape-differs")]
    assert window(wide, wide, **HERE) == (None, [])


def test_a_record_that_says_nothing_of_aspect_and_rotation_has_square_pixels_upright():
    assert picture_from_record({"width": 640, "height": 480}) == Picture(640, 480)
    assert picture_from_record({"width": 1, "height": 2, "sample_aspect": "8/9", "rotation": 90}) == Picture(
        1, 2, Fraction(8, 9), 90
    )


def test_what_bars_leave_is_taken_for_the_calibrations_picture_and_that_is_said():
    """Scaled by 1.25 into the middle of a larger picture: a pixel's middle lies where scaling and shift put it."""
    shown, found = window(Picture(384, 288), Picture(640, 480, bars=(80, 60, 80, 60)), **HERE)
    assert shown.scale == pytest.approx([1.25, 1.25])
    assert shown.seen([[-0.5, -0.5], [383.5, 287.5]]) == pytest.approx(np.array([[79.5, 59.5], [559.5, 419.5]]))
    assert [(f.level, f.code) for f in found] == [("doubtful", "picture-framed")]
    assert "80 px at the left, 60 px at the top" in found[0].text
    assert "crop: [-64, -48, 512, 384]" in found[0].cure
    assert window(Picture(384, 288), Picture(640, 480), [-64, -48, 512, 384], **HERE) == (shown, [])


def test_bars_in_a_picture_of_the_same_size_and_bars_of_the_calibration_count_as_well():
    framed, plain = Picture(384, 288, bars=(38, 29, 39, 29)), Picture(384, 288)
    shown, _ = window(plain, framed, **HERE)
    assert shown.scale == pytest.approx([307 / 384, 230 / 288])
    other, found = window(framed, plain, **HERE)
    assert other.seen([[37.5, 28.5], [344.5, 258.5]]) == pytest.approx(np.array([[-0.5, -0.5], [383.5, 287.5]]))
    assert [f.code for f in found] == ["picture-framed"]


def test_the_same_bars_in_run_and_calibration_are_part_of_the_picture():
    bars = Picture(640, 480, bars=(80, 60, 80, 60))
    assert window(bars, bars._replace(bars=(81, 60, 80, 58)), **HERE) == (None, [])
    half = Picture(320, 240, bars=(40, 30, 40, 30))
    assert [f.code for f in window(bars, half, **HERE)[1]] == ["picture-scaled"]


def test_bars_over_a_part_of_the_picture_are_doubted_and_bars_of_another_shape_and_size_refused():
    part, found = window(Picture(384, 288), Picture(384, 288, bars=(0, 36, 0, 36)), **HERE)
    assert part is None
    assert [(f.level, f.code) for f in found] == [("doubtful", "picture-framed")]
    assert "taken for a cover" in found[0].text
    with pytest.raises(VidtrackError, match=r"bars about its picture .*none; .*another shape.*crop"):
        window(Picture(384, 288), Picture(640, 480, bars=(0, 100, 0, 100)), **HERE)


def test_a_record_tells_the_bars_of_its_picture():
    assert picture_from_record({"width": 640, "height": 480, "bars": [80, 0, 80, 0]}).within == Picture(480, 480)
