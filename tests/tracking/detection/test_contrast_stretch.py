"""Grey levels stretched where a clip uses few of them."""

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detection.contrast_stretch import stretch

BALLS = [(40, 30, 5.0), (90, 60, 4.0), (130, 25, 5.0)]
SHAPE = (90, 160)


def shown(level, contrast, noise, *, full=255, in_full=255, k=3, seed=0):
    """k pictures of balls; level, contrast and noise in stored levels that the sensor ends at `full`."""
    rng = np.random.default_rng(seed)
    each = [picture(SHAPE, BALLS, level=level, contrast=contrast, noise=noise, rng=rng, dtype=float) for _ in range(k)]
    return [np.clip(np.rint(one), 0, full).astype(np.uint8 if in_full == 255 else np.uint16) for one in each]


@pytest.mark.parametrize(("full", "gain"), [(1023, 65535 / 1023), (4095, 65535 / 4095)])
@pytest.mark.parametrize("dark", [False, True])
def test_few_bits_in_a_file_of_sixteen_fill_it(full, gain, dark):
    level, contrast = (0.6 * full, -0.5 * full) if dark else (0.1 * full, 0.5 * full)
    found = stretch(shown(level, contrast, full / 128, full=full, in_full=65535), 16, dark=dark)
    assert (found.gain, found.offset) == (gain, 0)
    assert found.table[full] == found.table[-1] == 65535
    assert found.over(np.array([[0, full // 3]], np.uint16)).tolist() == [[0, round(full // 3 * gain)]]


@pytest.mark.parametrize("dark", [False, True])
def test_faint_targets_are_raised_to_half_the_range_with_room_to_turn_brighter(dark):
    found = stretch(shown(100, -6 if dark else 6, 0.5), 8, dark=dark)
    background, target = found.over(np.array([[100, 94 if dark else 106]], np.uint8))[0] / 257
    assert 60 < abs(target - background) < 120
    assert (target > 90) if dark else (target < 165)
    further = found.over(np.array([[91 if dark else 109]], np.uint8))[0, 0] / 257
    assert further - target == pytest.approx((-3 if dark else 3) * found.gain, abs=0.01)
    assert (np.diff(found.table.astype(int)) >= 0).all(), "levels never wrap"


@pytest.mark.parametrize("contrast", [20, 60, 200])
def test_clips_of_usual_contrast_stay_as_they_are(contrast):
    assert stretch(shown(30, contrast, 2), 8) is None
    assert stretch(shown(30 * 257, contrast * 257, 2 * 257, full=65535, in_full=65535), 16) is None


def test_noise_alone_is_not_stretched():
    assert stretch(shown(30, 0, 2), 8) is None
    assert stretch(shown(500, 0, 20, in_full=65535, full=4095), 16) is None


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_where_many_pixels_sit_on_the_greatest_level_the_sensor_ends_there(bits):
    end = 2**bits - 1 - 2**bits // 20
    noise = 2**bits / 256
    found = stretch(shown(2**bits / 8, 2**bits, noise, full=end, in_full=65535), 16)
    assert found.table[end] == 65535
    assert found.table[int(0.9 * end)] < 0.91 * 65535
    below = stretch(shown(2**bits / 8, 0.8 * end - 2**bits / 8, noise, full=end, in_full=65535), 16)
    assert below is None or below.table[int(0.8 * end)] < 0.8 * 65535
    given = stretch(shown(2**bits / 8, 2**bits, noise, full=end, in_full=65535), 16, gain=1.5, offset=0)
    assert given.table[end - 1] < 0.5 * 65535
    assert given.table[end] == 65535


def test_a_defect_of_the_sensor_does_not_hide_that_the_clip_is_faint():
    pictures = shown(100, 6, 0.5)
    for one in pictures:
        one[3, 3] = 255
    assert stretch(pictures, 8).gain > 8


def test_gain_and_offset_of_the_user_are_the_equation():
    found = stretch(shown(100, 60, 2), 8, gain=2.0, offset=90.0)
    assert found.over(np.array([[80, 90, 100, 150, 240, 255]], np.uint8))[0].tolist() == [
        0,
        0,
        20 * 257,
        120 * 257,
        65535,
        65535,
    ]
    assert stretch(shown(100, 6, 0.5), 8, gain=1, offset=0) is None
    mean = np.array([[100.25]], np.float32)
    assert found.grey(mean)[0, 0] == pytest.approx(20.5)


def test_the_sensor_s_end_is_full_scale_whatever_the_gain():
    found = stretch(shown(100, 60, 2), 8, gain=0.5, offset=0.0)
    assert found.table[254] == 127 * 257
    assert found.table[255] == 65535
    dark = stretch(shown(100, -60, 2), 8, dark=True, gain=0.5, offset=-100.0)
    assert dark.table[[0, 1]].tolist() == [0, round(50.5 * 257)]


@pytest.mark.parametrize("dark", [False, True])
def test_one_of_the_two_is_enough(dark):
    pictures = shown(100, -10 if dark else 10, 0.5)
    background, target = 100, 90 if dark else 110
    for wish in ({"gain": 8.0}, {"offset": 85.0}):
        found = stretch(pictures, 8, dark=dark, **wish)
        grey = found.over(np.array([[background, target]], np.uint8))[0] / 257
        assert 15 < grey.min() < grey.max() < 240
        assert np.ptp(grey) > 50
