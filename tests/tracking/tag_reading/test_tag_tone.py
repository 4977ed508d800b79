"""A camera's gamma is found from a tag, and corners measured with it are where the camera puts them."""

from fractions import Fraction

import numpy as np
import pytest

from tests.tracking.tag_reading.test_tag_corners import shown
from vidtrack.stages.coded_tags import coded_tags
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.tag_reading.tag_corners import Tone, tag_corners
from vidtrack.tracking.tag_reading.tag_reader import TagReader
from vidtrack.tracking.tag_reading.tag_tone import misfits, tone_of


def seen(gamma, seed=0, side=44.0, noise=2.0):
    """A picture whose levels are light to the power of 1/gamma, with noise after that, and the tag's corners."""
    turn = np.random.default_rng(seed).normal(0, 0.3, 3)
    light, truth = shown(side_px=side, seed=seed, turn=turn, noise=0.01)
    rng = np.random.default_rng(seed)
    level = 255 * (light / 255.0) ** (1 / gamma) + rng.normal(0, noise, light.shape)
    return np.clip(np.rint(level), 0, 255).astype(np.uint8), truth


@pytest.mark.parametrize("gamma", [1.0, 1.5, 2.2])
def test_the_power_is_found_from_the_tags_own_squares(gamma):
    each = [misfits(*seen(gamma, seed), 8, 255.0) for seed in range(3)]
    assert 1 / tone_of(each, 255.0).power == pytest.approx(gamma, abs=0.1)


def test_corners_measured_with_the_power_are_right_and_their_sd_is_honest():
    plain, found = [], []
    for seed in range(8):
        picture, truth = seen(2.2, seed)
        for tone, off in ((Tone(), plain), (Tone(1 / 2.2), found)):
            own = tag_corners(picture, truth, 8, tone)
            off.append((own.b - truth) / own.sd)
    assert np.sqrt(np.mean(np.square(plain))) > 5
    assert 0.7 < np.sqrt(np.mean(np.square(found))) < 1.3


def test_a_tag_that_is_small_or_faint_shows_no_power_and_corners_stay():
    assert misfits(*seen(2.2, side=30.0), 8, 255.0) is None
    picture, truth = seen(1.0)
    assert misfits((100 + picture // 20).astype(np.uint8), truth, 8, 255.0) is None
    assert tone_of([], 255.0).power == 1


@pytest.mark.parametrize(("gamma", "n", "codes"), [(2.2, 5, ["tag-gamma"]), (1.0, 2, [])])
def test_all_pictures_of_a_recording_are_measured_with_it_those_before_it_was_known_too(gamma, n, codes):
    pictures, truths = zip(*(seen(gamma, seed, side=56.0) for seed in range(n)), strict=True)
    info = VideoInfo(200, 160, Fraction(30), field_order="progressive")
    reader = TagReader("36h11", info)
    list(reader.over([Frame(i, Fraction(i, 30), p, False, None) for i, p in enumerate(pictures)]))
    found = reader.seen()
    off = (found.b[:, 0] - np.array(truths)) / found.sd[:, 0]
    assert np.nanmax(np.abs(off)) < 5
    tables = coded_tags(found, info.time, modules=8, named=[7])
    assert [f.code for f in tables.findings if f.code == "tag-gamma"] == codes
    assert tables.record["tags"]["tag7"]["gamma"] == pytest.approx(gamma, abs=0.1)
