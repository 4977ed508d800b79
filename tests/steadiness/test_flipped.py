"""Pictures that are mirrored or turned beside those of the calibration, by their background."""

import numpy as np
import pytest

from tests.steadiness.scenes import Wall
from vidtrack.steadiness.flipped import WAYS, flipped

OPEN = np.zeros((240, 320), bool)


def pictures(rng):
    wall = Wall(rng)
    noise = [rng.normal(0, 2, (240, 320)) for _ in range(2)]
    return wall.clean() + noise[0], wall.clean((0, 0.004, 0.002, 0)) + noise[1]


@pytest.mark.parametrize("words", WAYS)
def test_a_picture_that_is_turned_or_mirrored_is_recognised(words):
    calibrated, begun = pictures(np.random.default_rng(5))
    assert flipped(calibrated, np.ascontiguousarray(begun[WAYS[words]]), 1.0, OPEN) == words
    assert flipped(np.ascontiguousarray(calibrated[WAYS[words]]), begun, 2.0, OPEN) == words


def test_another_view_is_neither_mirrored_nor_turned_nor_is_the_same_one():
    rng = np.random.default_rng(6)
    calibrated, begun = pictures(rng)
    assert flipped(calibrated, pictures(rng)[0], 1.0, OPEN) is None
    assert flipped(calibrated, begun, 1.0, OPEN) is None
    assert flipped(calibrated, np.full_like(begun, 60.0), 1.0, OPEN) is None
    assert flipped(np.full_like(begun, 60.0), begun, 1.0, OPEN) is None


def test_what_is_shut_is_turned_with_the_picture():
    calibrated, begun = pictures(np.random.default_rng(7))
    shut = OPEN.copy()
    shut[:, :160] = True
    calibrated[:, :160] = 200.0 - calibrated[:, :160]  # balls in the clip, gone in the run
    words = "mirrored left to right"
    assert flipped(calibrated, np.ascontiguousarray(begun[WAYS[words]]), 1.0, shut) == words
