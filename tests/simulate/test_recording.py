"""A camera's own times, fields, shutter, losses."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.simulate.picture import Picture, empty_scene
from vidtrack.simulate.recording import Actor, Clock, Shutter, drawn_ball, exposures, frames, true_times
from vidtrack.simulate.rig import thesis_rig

RATE = Fraction(30000, 1001)
CAMERA = thesis_rig()[0]
PLAIN = Picture(background=0, contrast=200, noise=0, blur_px=0.5, bits=16)


def film(actors, times, *, shutter=None, interlace="none", picture=PLAIN, rate=RATE):
    empty = empty_scene(picture, CAMERA.image_size)
    rng = np.random.default_rng(3)
    shutter = shutter or Shutter(open_s=0)
    made = frames(
        CAMERA, empty, actors, times, picture=picture, shutter=shutter, rate=rate, interlace=interlace, rng=rng
    )
    return [image / 256 for image in made]


def ball(velocity=(0.0, 0.0, 0.0), at=(0.0, 0.0, 0.0), level=200.0, radius=1.0, hidden=()):
    return Actor(lambda t: np.asarray(at) + np.multiply.outer(t, np.asarray(velocity)), radius, level, hidden)


def centre_of_light(image, rows=slice(None)):
    light = image[rows]
    Y, X = np.arange(image.shape[0])[rows], np.arange(image.shape[1])
    return np.array([light.sum(0) @ X, light.sum(1) @ Y]) / light.sum()


def test_a_clocks_correction_gives_back_the_true_time():
    label = np.array([10.0, 40.0])
    assert true_times(label, Clock(offset_s=0.5, rate_ppm=100)) == pytest.approx([10.5, 40.5 + 30 * 100e-6])


def test_the_second_field_is_half_a_frame_later():
    (first, t0), (second, t1) = exposures(np.array([0.0, 1.0]), Fraction(25), "bottom")
    assert (first, second) == (1, 0)
    assert t1 - t0 == pytest.approx(0.02)
    assert exposures(np.zeros(1), Fraction(25), "none")[0][0] is None


def test_light_is_conserved_by_a_ball_that_moves_through_the_pixels():
    light = [image.sum() for image in film([ball((5.0, 0, 0))], np.arange(5) / 30)]
    still = film([ball()], np.zeros(1))[0].sum()
    depth = [CAMERA.R[2] @ [5 * t, 0, 0] + CAMERA.T[2] for t in np.arange(5) / 30]
    # the picture of a ball shrinks with the square of its distance
    assert light == pytest.approx([still * (CAMERA.T[2] / z) ** 2 for z in depth], rel=2e-3)


def test_a_moving_ball_is_where_the_camera_projects_it_at_the_frames_time():
    times = np.arange(6) / 30
    for t, image in zip(times, film([ball((60.0, 20.0, 10.0))], times), strict=True):
        assert centre_of_light(image) == pytest.approx(project(CAMERA, t * np.array([60.0, 20, 10])), abs=0.01)


def test_an_open_shutter_smears_a_ball_about_the_same_place_and_keeps_its_light():
    moving = ball((200.0, 0, 0))
    sharp = film([moving], np.zeros(1))[0]
    smeared = film([moving], np.zeros(1), shutter=Shutter(open_s=1 / 60, samples=21))[0]
    assert smeared.sum() == pytest.approx(sharp.sum(), rel=1e-3)
    # 3 in of smear: perspective moves its middle by 0.03 px
    assert centre_of_light(smeared) == pytest.approx(centre_of_light(sharp), abs=0.04)
    assert smeared.max() < 0.9 * sharp.max()


def test_a_ball_far_outside_the_picture_is_stretched_by_the_lens_and_does_no_harm():
    """Its outline needs more vertices than its distance leads to expect."""
    camera = CAMERA.with_(kappa1=-9e-5, f=14.0)
    depth, across = camera.T[2], camera.R[0]
    far = ball(at=tuple(2.4 * depth * across), radius=3.0)
    (piece,) = drawn_ball(camera, far, np.zeros(1), PLAIN, Shutter(open_s=0))
    assert piece.share.sum() > 0
    assert not (0 <= piece.left < camera.image_size[0])


def test_a_shaded_ball_gives_less_light_by_a_third_of_its_limbs_loss():
    shaded = film([ball(radius=3.0)], np.zeros(1), picture=PLAIN.model_copy(update={"limb": 0.6}))[0]
    plain = film([ball(radius=3.0)], np.zeros(1))[0]
    assert shaded.sum() / plain.sum() == pytest.approx(
        1 - 0.6 / 3, rel=5e-3
    )  # the mean of 1 - 0.6 (1 - sqrt(1 - rho^2))
    assert shaded.max() == pytest.approx(200, rel=5e-3)
    assert centre_of_light(shaded) == pytest.approx(centre_of_light(plain), abs=0.01)


@pytest.mark.parametrize("velocity", [(150.0, 0.0, 0.0), (0.0, 0.0, 150.0)])
def test_a_ball_leans_where_rows_see_it_one_after_the_other(velocity):
    readout = 0.02
    actor = ball(velocity, radius=3.0)
    leans, upright = (
        film([actor], np.zeros(1), shutter=Shutter(open_s=0, readout_s=seconds))[0] for seconds in (readout, 0.0)
    )
    rows = CAMERA.image_size[1]
    speed = np.diff(project(CAMERA, actor.path(np.array([-1e-3, 1e-3]))), axis=0)[0] / 2e-3
    u, v = speed * readout / rows
    _, yy, xy = moments(upright)
    seen = moments(leans)
    assert seen[2] - xy == pytest.approx(u * yy / (1 - v) ** 2, abs=0.05 * yy * abs(u) + 0.02)
    assert seen[1] == pytest.approx(yy / (1 - v) ** 2, rel=0.02)  # it is nearer, too
    assert max(abs(seen[2] - xy), abs(seen[1] - yy)) > 0.3


def moments(image):
    x, y = centre_of_light(image)
    Y, X = np.mgrid[: image.shape[0], : image.shape[1]]
    return [(image * a * b).sum() / image.sum() for a, b in ((X - x, X - x), (Y - y, Y - y), (X - x, Y - y))]


@pytest.mark.parametrize("order", ["top", "bottom"])
def test_each_field_shows_the_ball_at_its_own_time(order):
    velocity = np.array([80.0, 0, 0])
    image = film([ball(velocity, radius=2.0)], np.zeros(1), interlace=order)[0]
    late = float(1 / (2 * RATE)) * velocity
    first, second = (0, 1) if order == "top" else (1, 0)
    moved = centre_of_light(image, slice(second, None, 2)) - centre_of_light(image, slice(first, None, 2))
    assert moved == pytest.approx(project(CAMERA, late) - project(CAMERA, [0, 0, 0]), abs=0.06)
    assert np.hypot(*moved) > 3  # px: a woven frame is off by this much


def test_a_still_scene_looks_the_same_interlaced_or_not():
    assert (film([ball()], np.zeros(1), interlace="top")[0] == film([ball()], np.zeros(1))[0]).all()


def test_a_nearer_ball_hides_a_farther_one_whatever_their_order():
    away = CAMERA.R[2] * 10
    pair = [ball(at=away, level=100.0, radius=1.2), ball(level=200.0)]
    there, back = film(pair, np.zeros(1))[0], film(pair[::-1], np.zeros(1))[0]
    assert (there == back).all()
    X, Y = np.rint(project(CAMERA, [0, 0, 0])).astype(int)
    assert there[Y, X] == pytest.approx(200)


def test_a_hidden_target_is_not_there_and_then_is_again():
    images = film([ball(hidden=[(0.5, 1.5)])], np.array([0.0, 0.5, 1.4, 1.5]))
    assert [image.max() > 100 for image in images] == [True, False, False, True]


def test_a_ball_behind_the_camera_is_not_seen():
    assert film([ball(at=CAMERA.position - 20 * CAMERA.R[2])], np.zeros(1))[0].max() == 0


def test_films_come_in_chunks_that_nobody_notices(monkeypatch):
    picture = PLAIN.model_copy(update={"noise": 2.0, "background": 20.0})
    times = np.arange(5) / 30
    whole = film([ball((9.0, 0, 0))], times, picture=picture)
    monkeypatch.setattr("vidtrack.simulate.recording.CHUNK", 3)
    monkeypatch.setattr("vidtrack.simulate.recording.MEMORY", 1)
    assert np.array_equal(whole, film([ball((9.0, 0, 0))], times, picture=picture))
