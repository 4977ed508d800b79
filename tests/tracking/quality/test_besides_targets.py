"""A thing that stands still is doubtful as a target while something as bright moves and is none."""

import numpy as np
import pytest

from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.quality.besides_targets import BESIDES, SpreadPictures, still_findings
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import CONTRAST, MEASURED, PIXELS, X, Y

STILL = (40.0, 50.0)


def disc(shape, at, radius):
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.clip(radius + 0.5 - np.hypot(x - at[0], y - at[1]), 0, 1)


def film(way, *, light=120, radius=5, shape=(100, 160), n=40, noise=2.0, lamp=None, factor=1, shake=0):
    """Pictures of a dim disc that stands still and a ball on its way from (2,) to (2,) px."""
    rng = np.random.default_rng(5)
    shape = tuple(factor * s for s in shape)
    out = []
    for i in range(n):
        light_now = 40 + 50 * disc(shape, np.multiply(STILL, factor), 9 * factor)
        at = factor * (np.array(way[0]) + (np.array(way[1]) - way[0]) * i / (n - 1))
        light_now += (light - (light_now - 40) * (light > 0)) * disc(shape, at, radius * factor)
        light_now *= 1.0 if lamp is None else lamp[i]
        light_now = np.roll(light_now, rng.integers(-shake, shake + 1, 2), (0, 1)) if shake else light_now
        out.append(np.clip(np.rint(light_now + rng.normal(0, noise, shape)), 0, 255).astype(np.uint8))
    return out


def told(pictures, at=(STILL,), *, noise=2.0, contrast=50, pixels=254, chosen=False):
    """What is said of targets at (x, y) px, or of (samples, 2) of them."""
    spread = SpreadPictures(Detection(noise=noise))
    for first in range(0, len(pictures), 4):
        spread.passed([Sample(p, float(first + j)) for j, p in enumerate(pictures[first : first + 4])], first)
    values = np.full((MEASURED, len(pictures), len(at)), np.nan)
    values[[X, Y]] = np.stack([np.broadcast_to(one, (len(pictures), 2)) for one in at]).transpose(2, 1, 0)
    values[CONTRAST], values[PIXELS] = contrast, pixels
    names = [f"t{k + 1}" for k in range(len(at))]
    return still_findings(spread, values, names, Detection(noise=noise), chosen=chosen)


AWAY = ((52.0, 45.0), (130.0, 70.0))


def test_a_still_thing_that_a_ball_has_left_is_doubtful_as_a_target():
    (one,) = told(film(AWAY))
    assert (one.level, one.code) == ("doubtful", "target-stands-still")
    assert one.text.startswith("t1 stands still at (40, 50) px in samples 0 to ")
    assert "is no target" in one.text


def test_a_ball_that_moves_by_less_than_its_size_is_seen_as_well():
    assert len(told(film(((64.0, 30.0), (64.0, 44.0)), radius=7))) == 1


def test_what_moves_and_is_a_target_is_none_besides():
    way = np.linspace(*AWAY, 40)
    assert told(film(AWAY), [STILL, way]) == []


def test_a_target_that_moves_is_not_asked_about():
    assert told(film(AWAY), [np.linspace(STILL, (60, 60), 40)]) == []


@pytest.mark.parametrize("light", [15, 0])
def test_what_shines_less_than_the_target_is_no_target(light):
    assert told(film(AWAY, light=light)) == []


def test_light_that_changes_noise_and_a_camera_that_shakes_are_no_motion():
    assert told(film(AWAY, light=0, lamp=np.linspace(0.7, 1.3, 40))) == []
    assert told(film(AWAY, light=0, lamp=1 + 0.2 * np.sin(np.arange(40)))) == []
    assert told(film(AWAY, light=0, noise=6.0), noise=6.0) == []
    assert told(film(AWAY, light=0, shake=1)) == []


def test_of_given_targets_only_what_moves_away_from_them_counts():
    far = ((90.0, 20.0), (140.0, 80.0))
    assert len(told(film(far))) == 1
    assert told(film(far), chosen=True) == []
    assert len(told(film(AWAY), chosen=True)) == 1


def test_wide_pictures_are_reduced():
    pictures = film(AWAY, factor=12, n=20)
    assert len(told(pictures, [(480.0, 600.0)], pixels=254 * 144)) == 1


def test_few_pictures_are_kept_of_a_long_recording():
    spread = SpreadPictures(Detection())
    for first in range(0, 3000, 4):
        spread.passed([Sample(np.zeros((4, 6), np.uint8), float(first + j)) for j in range(4)], first)
    numbers = [one.number for one in spread.kept]
    assert BESIDES.pictures <= len(numbers) < 2 * BESIDES.pictures
    assert len(set(np.diff(numbers))) == 1
    assert numbers[-1] > 2000


def test_damaged_pictures_are_not_kept_and_fields_are_of_one_kind():
    spread = SpreadPictures(Detection())
    picture = np.zeros((4, 6), np.uint8)
    spread.passed([Sample(picture, 0.0, corrupt=True), Sample(picture, 1.0, repeated=True)], 0)
    assert spread.kept == []
    spread.passed([Sample(picture, 2.0 + j, parity=j % 2, lines=2) for j in range(4)], 2)
    assert [one.number for one in spread.kept] == [2, 4]
    assert spread.scale == (1.0, 2.0)
