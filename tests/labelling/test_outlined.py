"""Calibration balls that are lit from one side."""

from typing import NamedTuple

import numpy as np
import pytest

from tests.lit_balls import noisy, picture
from vidtrack.labelling.outlined import outlined
from vidtrack.labelling.shot import take


@pytest.fixture
def rng():
    return np.random.default_rng(11)


PLACES = [(x, y, 5.5) for x in (30.4, 70.1, 110.7, 150.2) for y in (25.3, 60.8, 95.1)]


class Still(NamedTuple):
    luma: np.ndarray
    corrupt: bool = False


def shown(rng, polarity="bright", **how):
    light = picture((120, 180), PLACES, **how)
    if polarity == "dark":
        light = 255 - light
    return take([Still(noisy(light, rng)) for _ in range(8)], {"polarity": polarity})


def found(shot, pixels=None):
    pixels = shot.blobs.pixels.astype(float) if pixels is None else pixels
    return outlined({"front": shot}, ["front"] * len(shot.at), shot.at, shot.sd, pixels)


def errors(at):
    truth = np.array([place[:2] for place in PLACES])
    return at - truth[np.linalg.norm(at[:, None] - truth, axis=-1).argmin(axis=1)]


@pytest.mark.parametrize("polarity", ["bright", "dark"])
def test_balls_lit_from_one_side_are_moved_to_their_outlines(polarity, rng):
    shot = shown(rng, polarity, lamp=(-1, 0.4, 0.6), ambient=0.3)
    assert len(shot.at) == len(PLACES)
    after = found(shot)
    assert after.lit.one_sided
    assert np.median(np.abs(errors(shot.at)[:, 0])) > 0.8
    assert np.abs(errors(after.at)).max() < 0.2
    assert (np.abs(errors(after.at)) < 5 * after.sd).all()
    assert after.width == pytest.approx(11.0, rel=0.08)


def test_balls_lit_from_everywhere_stay(rng):
    assert found(shown(rng, lamp=None)) is None


def test_what_a_person_placed_stays(rng):
    shot = shown(rng, lamp=(-1, 0.4, 0.6))
    pixels = shot.blobs.pixels.astype(float)
    pixels[3] = 0
    after = found(shot, pixels)
    assert (after.at[3] == shot.at[3]).all()
    assert (after.sd[3] == shot.sd[3]).all()
    assert (after.at[4] != shot.at[4]).all()
