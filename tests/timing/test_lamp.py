"""How bright pictures are, told by a few of their rows."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.frame import Frame
from vidtrack.timing.lamp import LightMeter, brightness
from vidtrack.timing.timebase import time_base


def frame(i, luma, corrupt=False):
    return Frame(i, Fraction(i, 30), luma, corrupt, None)


@pytest.mark.parametrize("size", [(1, 5), (3, 4), (63, 64), (480, 640), (1080, 1920)])
def test_a_few_rows_tell_the_brightness_of_the_whole(size):
    rng = np.random.default_rng(0)
    picture = np.full(size, 100, np.uint8)
    assert brightness(picture) == 100
    noisy = rng.integers(90, 111, size).astype(np.uint8)
    assert brightness(noisy) == pytest.approx(100, abs=30 / np.sqrt(min(noisy.size, 32 * size[1])))


def test_both_fields_count_alike():
    picture = np.zeros((480, 640), np.uint8)
    picture[1::2] = 200
    assert brightness(picture) == 100


def test_frames_pass_unchanged_and_leave_their_time_and_light_on_any_depth():
    frames = [frame(i, np.full((8, 8), 1023 * i // 4, np.uint16), corrupt=i == 2) for i in range(5)]
    meter = LightMeter(10)
    assert list(meter.over(frames)) == frames
    assert meter.stamps == pytest.approx(np.arange(5) / 30)
    assert meter.levels[[0, 1, 3, 4]] == pytest.approx([0, 63.75, 191.25, 255], abs=0.3)
    assert np.isnan(meter.levels[2])


def test_the_middle_of_two_exposures_is_a_quarter_of_a_frame_after_the_first():
    meter = LightMeter(8)
    assert len(list(meter.over(frame(i, np.full((4, 4), 50 + i, np.uint8)) for i in range(3)))) == 3
    whole, fields = (meter.columns(time_base(Fraction(30)), in_fields=each) for each in (False, True))
    assert whole["frame"].tolist() == [0, 1, 2]
    assert whole["brightness"].tolist() == [50, 51, 52]
    np.testing.assert_allclose(whole["middle_s"], whole["time_s"])
    np.testing.assert_allclose(fields["middle_s"] - fields["time_s"], 0.25 / 30)
