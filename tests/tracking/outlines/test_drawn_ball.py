"""The picture of a ball, drawn for a fit."""

import numpy as np
import pytest

from tests.lit_balls import picture
from vidtrack.tracking.outlines.drawn_ball import BallView, drawn

SHAPE, PLACE = (41, 45), (21.3, 19.6)


def view(**how):
    return BallView(np.zeros(SHAPE), *PLACE, 1, **how)


@pytest.mark.parametrize("radius", [3.0, 7.0])
def test_a_ball_covers_its_disc(radius):
    cover, _ = drawn(view(), np.array([0, 0, np.log(radius), np.log(0.7), 0]))
    assert cover.sum() == pytest.approx(np.pi * radius**2, rel=0.01)
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    assert ((cover * column).sum() / cover.sum(), (cover * row).sum() / cover.sum()) == pytest.approx(PLACE, abs=0.01)


def test_its_light_is_that_of_a_lamp():
    angle, toward = 0.9, 0.4
    lamp = (np.sin(angle) * np.cos(toward), np.sin(angle) * np.sin(toward), np.cos(angle))
    light = picture(SHAPE, [(*PLACE, 6.0)], lamp=lamp, ambient=0.3, level=180.0, ground=30.0, blur=0.7)
    _, parts = drawn(view(), np.array([0, 0, np.log(6.0), np.log(0.7), 0, angle, toward]))
    ball, lit, free = parts[:3]
    assert np.abs(180 * (0.3 * ball + 0.7 * lit) + 30 * free - light).max() < 4


def test_a_line_cuts_it():
    _, (above, below, *_) = drawn(view(cut=True), np.array([0, 0, np.log(6.0), np.log(0.7), 0, 0.0, np.pi / 2]))
    assert above.sum() == pytest.approx(np.pi * 18, rel=0.02)
    assert (below[24:-3, 3:-3] > 0.999).all()
    assert (below[:16] < 0.001).all()
