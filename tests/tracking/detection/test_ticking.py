"""Digits of a running time are found where they change; what passes, flickers or swings is not taken for them."""

import cv2
import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.static_clutter import static_clutter
from vidtrack.tracking.detection.ticking import ticking
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.sample import Sample

DETECTION = Detection(noise=2.0)
SHAPE = (120, 160)
K = np.arange(12)


def stamped(pictures, scale=0.5):
    """With a running number, whose last digit lies in x 32 to 40, y 50 to 61 px."""
    out = []
    for k, one in enumerate(pictures):
        luma = one.copy()
        cv2.putText(luma, f"00:{k:02d}", (2, 61), cv2.FONT_HERSHEY_SIMPLEX, scale, 220, 1, cv2.LINE_AA)
        out.append(luma)
    return out


def discs(path, *, contrast=150.0, radius=5.0):
    rng = np.random.default_rng(0)
    light = np.broadcast_to(contrast, len(path))
    return [
        picture(SHAPE, [(*at, radius)], level=30, contrast=c, noise=2, rng=rng)
        for at, c in zip(path, light, strict=True)
    ]


def line(step):
    return np.stack([60 + step * K, 30 + 0.0 * K], axis=-1)


def test_a_digit_that_changes_in_every_picture_ticks_and_nothing_else():
    where = ticking(stamped(discs(line(3.0))), DETECTION)
    rows, columns = np.nonzero(where)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == pytest.approx((49, 62, 31, 41), abs=1)


def test_a_digit_that_changes_seldom_does_not_tick():
    assert ticking([luma for luma in stamped(discs(line(3.0)))[:1] for _ in K], DETECTION) is None
    assert ticking(stamped(discs(line(3.0)))[:7], DETECTION) is None  # too few to say


@pytest.mark.parametrize("step", [0.0, 0.3, 1.0, 4.0])
def test_a_target_that_passes_does_not_tick(step):
    assert ticking(discs(line(step)), DETECTION) is None


def test_a_lamp_that_flickers_and_a_target_that_swings_do_not_tick():
    assert ticking(discs(line(0.0), contrast=np.where(K % 2, 150.0, 20.0)), DETECTION) is None
    swings = np.stack([60 + 2.0 * (-1.0) ** K, 30 + 0.0 * K], axis=-1)
    assert ticking(discs(swings), DETECTION) is None


def test_targets_in_a_row_do_not_tick():
    rng = np.random.default_rng(0)
    rows = [[(20.0 + 4 * k + 12 * i, 60.0, 3.0) for i in range(-3, 9)] for k in K]
    assert ticking([picture(SHAPE, row, level=30, contrast=150, noise=2, rng=rng) for row in rows], DETECTION) is None


def test_the_digit_is_static_clutter_and_stays_so_when_it_is_dark():
    samples = [Sample(luma, float(k)) for k, luma in enumerate(stamped(discs(line(3.0))))]
    backgrounds = background_of(samples, DETECTION)
    every = np.max([sample.luma for sample in samples], axis=0)
    assert (backgrounds[0][50:62, 32:41] == every[50:62, 32:41]).all()
    static = static_clutter(samples, backgrounds, DETECTION, np.zeros((0, 4)))
    whole = WholePicture(backgrounds, DETECTION, static)
    for k in (13, 21, 47):
        luma = discs([(100.0, 90.0)])[0]
        cv2.putText(luma, f"00:{k:02d}", (2, 61), cv2.FONT_HERSHEY_SIMPLEX, 0.5, 220, 1, cv2.LINE_AA)
        whole.candidates(Sample(luma, float(k)), np.zeros((0, 2)), np.zeros((0, 2)), 150.0)
    assert whole.static.touched([Sample(luma, 0.0)], [[41.0]], [[56.0]], [4], [6])[0, 0]
