"""What is left of the picture where targets move, and that no target leaves a ghost in it."""

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


def test_fields_have_backgrounds_of_their_own():
    samples = films(line(0.2, 24), k=24)
    fields = [s._replace(luma=s.luma[p::2], parity=p, lines=2, time=2 * s.time + p) for s in samples for p in (0, 1)]
    pictures = background_of(fields, DETECTION)
    assert sorted(pictures) == [0, 1]
    assert all(p.shape == (40, 120) and p.max() < 46 for p in pictures.values())
