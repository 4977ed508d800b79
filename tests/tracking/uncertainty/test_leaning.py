"""Moving balls lean where rows are read one after the other, and one camera shows its read-out by that."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.simulate.picture import Picture, empty_scene
from vidtrack.simulate.recording import Actor, Shutter, frames
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.centroiding.streak import drawn_out
from vidtrack.tracking.uncertainty.leaning import LEANING, UNKNOWN, leaning

K = 240
TIME = np.arange(K, dtype=float)
LATER = 1e-3


def course(w=0.13):
    return np.stack([300 + 60 * np.sin(w * TIME), 200 + 40 * np.sin(0.77 * w * TIME + 0.4)])


def shown(place, later=LATER, exposure=0.0, seed=2, noise=0.02, columns=False):
    """What targets at places (2, K) show, moments of 16 px^2, whose rows are seen so much later each."""
    rng = np.random.default_rng(seed)
    velocity = np.gradient(place, axis=1)
    u, v = velocity[::-1] if columns else velocity
    second = np.array([16 + 0 * u, 16 * (1 + 2 * later * v), 16 * later * u])
    second = second[[1, 0, 2]] if columns else second
    second = second + exposure**2 * drawn_out(velocity) + rng.normal(0, noise, (3, K))
    every = np.ones((K, 1), bool)
    return leaning(second[..., None], place[..., None], velocity[..., None], every, columns=columns)


@pytest.mark.parametrize("columns", [False, True])
@pytest.mark.parametrize("later", [LATER, -LATER, 0.0])
def test_the_time_from_row_to_row_is_found(later, columns):
    found = shown(course(), later, columns=columns)
    assert found.sd < 0.1 * LATER
    assert abs(found.later - later) < 4 * found.sd


def test_motion_blur_is_no_lean():
    found = shown(course(), 0.0, exposure=0.9)
    assert abs(found.later) < 4 * found.sd < 0.4 * LATER


def test_a_ball_that_the_lens_shows_oblong_does_not_lean():
    place = course()
    x, y = (place - place.mean(axis=1, keepdims=True)) / 100
    rng = np.random.default_rng(3)
    second = np.array([16 + 2 * x * x, 16 + 2 * y * y + x, 2 * x * y + y]) + rng.normal(0, 0.02, (3, K))
    velocity = np.gradient(place, axis=1)
    found = leaning(second[..., None], place[..., None], velocity[..., None], np.ones((K, 1), bool))
    assert abs(found.later) < 5 * found.sd < 0.5 * LATER


@pytest.mark.parametrize("where", ["at rest", "steady", "seldom"])
def test_what_shapes_cannot_show_is_not_known(where):
    place = {"at rest": 0 * course(), "steady": 3.0 * np.stack([TIME, TIME]), "seldom": course()}[where]
    if where != "seldom":
        assert shown(place) == UNKNOWN
        return
    seen = (TIME < LEANING.samples[0] - 1)[:, None]
    second = np.full((3, K, 1), 16.0)
    assert leaning(second, place[..., None], np.gradient(place, axis=1)[..., None], seen) == UNKNOWN


def test_along_a_line_it_is_found_as_well():
    along = 60 * np.sin(0.13 * TIME)
    found = shown(np.stack([300 + along, 200 + 0.4 * along]))
    assert abs(found.later - LATER) < 4 * found.sd < 0.4 * LATER


def path(t):
    t = np.asarray(t)
    return np.stack([16 * np.sin(3.5 * t), 3 * np.sin(2 * t), 11 * np.sin(5 * t)], -1)


@pytest.mark.parametrize("readout", [0.0, 0.016])
def test_a_drawn_film_shows_its_read_out(readout):
    (camera, *_), picture, rate = thesis_rig(2), Picture(noise=3.0), Fraction(30)
    film = frames(
        camera,
        empty_scene(picture, camera.image_size),
        [Actor(path, 2.0, 220.0)],
        np.arange(K) / 30,
        picture=picture,
        shutter=Shutter(readout_s=readout),
        rate=rate,
        interlace="none",
        rng=np.random.default_rng(1),
    )
    pictures = [Frame(k, Fraction(k, 30), one, False, None) for k, one in enumerate(film)]
    width, height = camera.image_size
    found = track(pictures, VideoInfo(width, height, rate, field_order="progressive"), targets=1)
    lean = found.diagnostics["leaning"]
    assert abs(lean["later"] * height / 30 - readout) < max(4 * lean["sd"] * height / 30, 0.12 * readout, 0.002)
    assert lean["sd"] * height / 30 < 0.0025
