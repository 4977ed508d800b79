import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detection.threshold import THRESHOLD, automatic, background_level, grey_scale, noise_sd


@pytest.mark.parametrize("sd", [0.5, 1.0, 3.0, 10.0])
def test_noise_is_measured_to_a_few_percent_whatever_the_targets(sd):
    rng = np.random.default_rng(0)
    targets = [(20.0 + 30 * i, 20.0 + 30 * j, 5.0) for i in range(8) for j in range(8)]
    image = picture((260, 260), targets, level=60, noise=sd, rng=rng)
    rounding = np.hypot(sd, 12**-0.5)
    assert noise_sd(image) == pytest.approx(rounding, rel=0.15)  # whole levels are coarse at 0.5


def test_a_picture_without_noise_still_has_the_noise_of_rounding():
    assert noise_sd(np.full((50, 50), 7, np.uint8)) == pytest.approx(12**-0.5)
    assert noise_sd(np.full((50, 50), 7, np.uint16), scale=255 / 1023) == pytest.approx(12**-0.5 * 255 / 1023)


def test_ten_bit_noise_is_told_in_grey_levels():
    image = picture((200, 200), [], noise=3.0, rng=np.random.default_rng(1), dtype=np.uint16)
    assert noise_sd(image, scale=255 / 1023) == pytest.approx(3.0, rel=0.05)


def test_grey_levels_reach_255_at_any_depth():
    assert 255 * grey_scale(np.dtype(np.uint8)) == 255
    assert 1023 * grey_scale(np.dtype(np.uint16), 10) == pytest.approx(255)
    assert 65535 * grey_scale(np.dtype(np.uint16)) == pytest.approx(255)
    assert grey_scale(np.dtype(np.float32)) == 1


def test_the_background_is_the_usual_level():
    image = picture(
        (200, 200), [(50.0, 50.0, 20.0), (150.0, 120.0, 30.0)], level=42, noise=2, rng=np.random.default_rng(2)
    )
    assert background_level(image) == pytest.approx(42, abs=1)


@pytest.mark.parametrize("n", [1, 40])
def test_the_threshold_does_not_depend_on_how_many_targets_there_are(n):
    """Contrast 200: 0.4 of it, although one target is a ten-thousandth of the picture."""
    targets = [(30.0 + 60 * (i % 8), 30.0 + 60 * (i // 8), 4.0) for i in range(n)]
    over = picture((500, 500), targets, level=0, dtype=float)
    assert automatic(over, 3.0) == pytest.approx(80, abs=4)


def test_an_empty_picture_keeps_the_threshold_out_of_its_noise():
    over = np.random.default_rng(3).normal(0, 5, (300, 300))
    assert automatic(over, 5.0) == THRESHOLD.sigmas * 5
    assert automatic(over * 0, 0.1) == THRESHOLD.least_contrast
