"""What is left of the picture where targets move, and that no target leaves a ghost in it."""

import cv2
import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of, without_ghosts
from vidtrack.tracking.sample import Sample

DETECTION = Detection(noise=2.0)
SHAPE = (80, 120)


def films(path, *, radius=5.0, still=(), k=12):
    rng = np.random.default_rng(0)
    return [
        Sample(picture(SHAPE, [(*at, radius), *still], level=30, contrast=150, noise=2, rng=rng), float(i))
        for i, at in enumerate(path[:k])
    ]


def line(step, k=12, start=(50.0, 40.0)):
    return np.array(start) + np.arange(k)[:, None] * np.array([step, 0.3 * step])


@pytest.mark.parametrize("step", [0.1, 0.2, 0.4, 0.8, 3.0])
def test_what_moves_at_any_speed_leaves_nothing_in_the_background(step):
    background = background_of(films(line(step)), DETECTION)[0]
    assert background.max() < 30 + 8 * 2


def test_a_target_that_goes_and_comes_back_leaves_no_ghost_either():
    there = 50 + 3 * np.sin(np.pi * np.arange(12) / 11)
    background = background_of(films(np.stack([there, np.full(12, 40.0)], -1)), DETECTION)[0]
    assert background.max() < 30 + 8 * 2


def test_things_that_stand_still_stay_in_the_background():
    still = [(20.3, 20.6, 5.0), (95.0, 60.2, 4.0)]
    background = background_of(films(line(0.4), still=still), DETECTION)[0]
    assert [int(background[round(y), round(x)]) for x, y, _ in still] == pytest.approx([180, 180], abs=8)


def test_a_long_thing_that_a_target_passes_is_no_ghost():
    def stick(sample):
        luma = sample.luma.copy()
        luma[30:34, 10:110] = 200
        return sample._replace(luma=luma)

    background = background_of([stick(sample) for sample in films(line(0.4))], DETECTION)[0]
    assert (background[31:33, 12:108] > 180).all()


def test_a_ring_with_something_dim_in_its_middle_is_no_ghost():
    """A written 0 with a thin stroke, which is always a little darker than half-way."""

    def written(sample):
        y, x = np.ogrid[: SHAPE[0], : SHAPE[1]]
        away = np.hypot(x - 95, y - 60)
        luma = np.where((away > 3.5) & (away < 6), 200, np.where((away < 4) & (x == 95), 103, sample.luma))
        return sample._replace(luma=luma.astype(np.uint8))

    background = background_of([written(sample) for sample in films(line(3.0))], DETECTION)[0]
    assert background[60, 95:102].max() == 200


def test_a_ghost_is_filled_with_what_is_about_it_and_nothing_else_changes():
    """A slope of 0.5 grey levels a pixel behind it."""
    slope = (0.5 * np.arange(120))[None] + np.zeros((80, 1))
    pictures = [picture(SHAPE, [(50 + 0.5 * k, 40, 5.0)], level=30 + slope, contrast=120) for k in range(5)]
    ghost = np.min(pictures, axis=0)
    filled = without_ghosts(ghost, pictures, Detection(noise=0.3))
    assert int(filled[40, 51]) == pytest.approx(55, abs=6)
    changed = np.argwhere(filled != ghost)
    assert np.hypot(*(changed - [40, 51]).T).max() < 12
    assert (filled[:, :30] == ghost[:, :30]).all()


def balls(paths, *, radius, shape=(200, 320)):
    rng = np.random.default_rng(1)
    return [
        Sample(picture(shape, [(*at, radius) for at in places], level=30, contrast=150, noise=2, rng=rng), float(i))
        for i, places in enumerate(zip(*paths, strict=True))
    ]


def test_large_balls_that_come_to_touch_leave_no_ghosts():
    """Neither is seen alone in most pictures: both go 3 px a sample towards each other."""
    samples = balls([line(3.0, start=(80.0, 95.0)), line(-3.0, start=(190.0, 105.0))], radius=30.0)
    assert background_of(samples, DETECTION)[0].max() < 30 + 8 * 2


def test_a_ball_as_large_as_the_surroundings_that_it_is_compared_with_leaves_no_ghost():
    samples = balls([line(0.5, start=(150.0, 240.0))], radius=70.0, shape=(480, 320))
    assert background_of(samples, DETECTION)[0].max() < 30 + 8 * 2


def test_a_hoop_that_stands_still_stays_in_the_background():
    samples = films(line(0.4, start=(20.0, 15.0)))
    outer, inner = (picture(SHAPE, [(70, 45, radius)], level=0, contrast=150) for radius in (16.0, 11.0))
    background = background_of([s._replace(luma=cv2.add(s.luma, outer - inner)) for s in samples], DETECTION)[0]
    assert int(background[45, 83]) == pytest.approx(180, abs=10)


def test_a_lamp_that_a_target_touches_in_passing_stays_in_the_background():
    """It makes the lamp's blob larger and moves its middle, in two of the five pictures."""
    lamp = (60.0, 40.0, 7.0)
    background = background_of(films(line(6.0, start=(13.0, 29.0)), still=[lamp], radius=4.0), DETECTION)[0]
    assert int(background[40, 60]) == pytest.approx(180, abs=8)


def test_a_wide_patch_that_a_small_target_leaves_stays_in_the_background():
    """A tenth more than its pixels, at its rim, moves its middle by 1.7 px."""
    patch = (50.0, 40.0, 15.0)
    samples = films(line(3.0, start=(68.0, 40.0)), still=[patch], radius=5.0)
    assert int(background_of(samples, DETECTION)[0][40, 50]) == pytest.approx(180, abs=8)


def test_fields_have_backgrounds_of_their_own():
    samples = films(line(0.2, 24), k=24)
    fields = [s._replace(luma=s.luma[p::2], parity=p, lines=2, time=2 * s.time + p) for s in samples for p in (0, 1)]
    pictures = background_of(fields, DETECTION)
    assert sorted(pictures) == [0, 1]
    assert all(p.shape == (40, 120) and p.max() < 46 for p in pictures.values())
