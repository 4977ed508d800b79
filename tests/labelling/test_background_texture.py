"""What a pattern behind the balls does to their centroids is read off the picture, and agrees with their errors."""

import cv2
import numpy as np
import pytest

from tests.labelling.test_shot import balls, clip
from vidtrack.labelling.shot import take

AT = np.array([(40 + 48 * i + 0.31 * j, 40 + 44 * j + 0.47 * i) for j in range(5) for i in range(6)])
SHAPE = (260, 330)


def grain(seed, contrast, size=2.0):
    pattern = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, SHAPE), (0, 0), size)
    return contrast * pattern / pattern.std()


FEW = AT[::5]


def scene(seed, contrast, at=AT, level=200.0):
    plain = balls(at, level=level, background=60.0, shape=SHAPE)
    covered = (plain - 60.0) / (level - 60.0)
    return clip(plain + (1 - covered) * grain(seed, contrast), 16, noise=1.0, seed=seed)


def errors_of(shot):
    d = np.linalg.norm(shot.at[:, None] - AT, axis=-1)
    nearest = d.argmin(1)
    good = d.min(1) < 3
    return (shot.at - AT[nearest])[good], shot.sd[good]


@pytest.mark.parametrize("contrast", [3.0, 8.0])
def test_the_sd_holds_what_the_pattern_does(contrast):
    found = [errors_of(take(scene(seed, contrast), {}, None, len(AT))) for seed in range(5)]
    errors, sd = (np.concatenate(part) for part in zip(*found, strict=True))
    assert len(errors) > 0.95 * 5 * len(AT)
    assert 0.6 < np.sqrt((errors**2).mean() / (sd**2).mean()) < 1.5


def test_an_even_background_adds_nothing():
    even = take(clip(balls(AT, background=60.0, shape=SHAPE), 16, noise=1.0, seed=3), {})
    assert np.median(even.sd) < 0.01
    slope = np.linspace(0, 60, SHAPE[1])[None]
    shaded = take(clip(balls(AT, background=60.0, shape=SHAPE) + slope, 16, noise=1.0, seed=3), {})
    assert np.median(shaded.sd) < 0.01


def test_far_more_blobs_than_balls_raise_the_threshold_to_the_balls():
    strong = scene(7, 13.0, FEW)
    assert len(take(strong, {}).at) > 3 * len(FEW)
    raised = take(strong, {}, None, len(FEW))
    assert len(raised.at) == len(FEW)
    assert 80 < raised.settings["threshold"] < 180


def test_a_threshold_of_the_config_stands():
    strong = scene(7, 13.0, FEW)
    assert len(take(strong, {"threshold": 75}, None, len(FEW)).at) > 3 * len(FEW)


def test_dark_balls_before_a_pattern_are_found_as_well():
    frames = [f._replace(luma=255 - f.luma) for f in scene(7, 13.0, FEW)]
    raised = take(frames, {"polarity": "dark"}, None, len(FEW))
    assert len(raised.at) == len(FEW)


def test_a_pattern_in_a_part_of_the_picture_counts_for_the_balls_before_it():
    plain = balls(AT, background=60.0, shape=SHAPE)
    covered = (plain - 60.0) / plain.max()
    part = grain(11, 8.0) * (np.arange(SHAPE[1]) < 110)
    shot = take(clip(plain + (1 - covered) * part, 16, noise=1.0, seed=11), {}, None, len(AT))
    sd, x = np.linalg.norm(shot.sd, axis=1), shot.at[:, 0]
    assert np.median(sd[x < 100]) > 5 * np.median(sd[x > 200])
