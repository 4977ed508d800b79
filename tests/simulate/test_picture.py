"""Grey levels: what a sensor makes of light."""

import numpy as np
import pytest

from vidtrack.simulate.picture import Patch, Picture, developed, empty_scene, paint


def test_the_background_rises_as_told_and_has_its_level_in_the_middle():
    scene = empty_scene(Picture(background=50, gradient=(10, -4)), (200, 100))
    assert scene.shape == (100, 200)
    assert scene.mean() == pytest.approx(50, abs=1e-3)
    assert scene[50, 199] - scene[50, 0] == pytest.approx(10 * 199 / 200, abs=1e-3)
    assert scene[99, 7] - scene[0, 7] == pytest.approx(-4 * 99 / 100, abs=1e-3)


def test_clutter_covers_pixels_by_its_share():
    sign = Patch(camera="cam1", left=10.25, top=5, width=2, height=1, level=100)
    scene = empty_scene(Picture(background=0), (20, 10), [sign])
    assert scene[5, 9:14] == pytest.approx([0, 75, 100, 25, 0])
    assert scene.sum() == pytest.approx(200)


def test_a_ball_over_the_edge_of_the_picture_leaves_only_what_is_inside():
    scene = np.zeros((10, 10), np.float32)
    paint(scene, np.ones((4, 4)), -2, 8, 7.0)
    assert scene.sum() == pytest.approx(7 * 2 * 2)
    paint(scene, np.ones((4, 4)), 50, 50, 7.0)
    assert scene.sum() == pytest.approx(7 * 2 * 2)


@pytest.mark.parametrize("top", [-3, 2, 3, 8])
@pytest.mark.parametrize("field", [0, 1])
def test_a_field_paints_its_own_rows_alone(top, field):
    share = np.random.default_rng(1).random((5, 5))
    whole, part = np.zeros((10, 10), np.float32), np.zeros((10, 10), np.float32)
    paint(whole, share, 2, top, 9.0)
    paint(part, share, 2, top, 9.0, field)
    assert (part[field::2] == whole[field::2]).all()
    assert not part[1 - field :: 2].any()


def test_a_nearer_ball_hides_what_lies_behind():
    scene = np.zeros((3, 3), np.float32)
    paint(scene, np.ones((3, 3)), 0, 0, 200.0)
    paint(scene, np.full((3, 3), 0.5), 0, 0, 100.0)
    assert scene == pytest.approx(np.full((3, 3), 150.0))


def test_noise_has_the_spread_that_was_asked_and_no_bias():
    scene = np.full((400, 400), 100.3, np.float32)
    image = developed(Picture(noise=3), scene, 0.0, np.random.default_rng(2)).astype(float)
    assert image.std() == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.01)  # rounding adds its twelfth
    assert image.mean() == pytest.approx(100.3, abs=4 * 3 / 400)
    assert abs(np.corrcoef(image[:, 1:].ravel(), image[:, :-1].ravel())[0, 1]) < 0.01
    assert np.mean((image - 100.3) ** 4) / image.var() ** 2 == pytest.approx(3, abs=0.05)  # as a normal law's


def test_grey_levels_saturate():
    picture = Picture(noise=0, gain=2, offset=-20)
    assert developed(picture, np.array([[5, 100, 200]], np.float32), 0.0, np.random.default_rng(0)).tolist() == [
        [0, 180, 255]
    ]


def test_more_bits_record_finer_levels():
    deep = developed(Picture(noise=0, bits=10), np.array([[100.25, 300]], np.float32), 0.0, np.random.default_rng(0))
    assert deep.dtype == np.uint16
    assert deep.tolist() == [[401, 1023]]


def test_light_that_drifts_and_flickers_scales_the_scene():
    picture = Picture(noise=0, light_drift_per_s=-0.01, flicker=0.05, flicker_hz=0.25)
    assert developed(picture, np.array([[100]], np.float32), 1.0, np.random.default_rng(0))[0, 0] == 104
    assert developed(picture, np.array([[100]], np.float32), 3.0, np.random.default_rng(0))[0, 0] == 92
