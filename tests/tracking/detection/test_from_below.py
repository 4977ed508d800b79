"""A ball that is lit from one side begins as the whole ball; all others begin as before."""

import numpy as np
import pytest

from tests.discs import picture as discs
from tests.lit_balls import noisy, picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.from_below import from_below
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance

DETECTION = Detection(noise=1.5)
AT = np.array([[32.0, 30.0]])


def known(pixels, contrast, background=30.0, size=(8.0, 4.0)):
    """What first sight shows of a target: soft edge and unrest are not known."""
    return Appearance(np.array([[pixels, contrast, background, *size, np.nan, np.nan, contrast]]).T)


def begun(luma, looks, level, lines=1, detection=DETECTION, at=AT):
    return from_below(Sample(luma[::lines], 0.0, 0, lines), at, looks, np.array([level]), detection)


def crescent(lines=1):
    """A ball of 75 pixels, half of whose light comes from below; its lit side alone stands out at a high threshold."""
    light = picture((64, 64), [(32.0, 30.0, 4.9)], lamp=(0, 1, -0.2), ambient=0.35)
    return noisy(light, np.random.default_rng(3))


@pytest.mark.parametrize("lines", [1, 2])
def test_a_ball_with_two_thresholds_begins_with_the_lower_one(lines):
    luma = crescent()
    peak = float(luma.max()) - 30
    looks, level = begun(luma, known(20.0, 0.75 * peak), 30 + 0.5 * peak, lines)
    assert level[0] < 30 + 0.45 * peak
    assert looks.pixels[0] == pytest.approx(75 / lines, rel=0.15)
    assert looks.size[:, 0] == pytest.approx([10, 10 / lines], abs=1.1)


def test_a_ball_with_light_from_all_sides_begins_as_it_was():
    luma = noisy(discs((64, 64), [(32.0, 30.0, 4.9, 120.0)], level=30.0).astype(float), np.random.default_rng(3))
    for share in (0.5, 0.6, 0.75):  # first sight takes a target for up to 1.4 times as bright as it is
        looks, level = begun(luma, known(60.0, 120.0, size=(9.0, 9.0)), 30 + share * 120)
        assert (looks.pixels[0], level[0]) == (60.0, 30 + share * 120)


def test_a_bright_ball_beside_a_dim_one_begins_as_it_was():
    luma = noisy(discs((64, 64), [(32.0, 30.0, 4.0, 120.0), (32.0, 37.5, 4.0, 60.0)], level=30.0).astype(float),
                 np.random.default_rng(3))  # fmt: skip
    looks, level = begun(luma, known(40.0, 120.0, size=(7.0, 7.0)), 100.0)
    assert (looks.pixels[0], level[0]) == (40.0, 100.0), "both together are long"


def test_what_was_measured_is_not_known_or_has_a_threshold_of_the_users_stays():
    luma = crescent()
    peak = float(luma.max()) - 30
    level = 30 + 0.5 * peak
    measured = known(20.0, peak)
    measured.values[5:7] = 1.0
    assert begun(luma, measured, level)[1][0] == level
    assert begun(luma, known(np.nan, np.nan), level)[1][0] == level
    assert begun(luma, known(20.0, peak), level, detection=Detection(noise=1.5, threshold=level))[1][0] == level
    assert begun(luma, known(20.0, peak), level, at=np.array([[np.nan, 3.0]]))[1][0] == level
