"""What a ball that moves during the exposure shows is a streak, and what three balls show is none."""

import numpy as np
import pytest

from tests.tracking.discs.test_three_discs import round_about, window
from vidtrack.tracking.centroiding.streak import drawn_out, streak_left
from vidtrack.tracking.discs.clump import clump_at
from vidtrack.tracking.discs.three_discs import three_discs


def streak(way, bend=(0.0, 0.0), radius=6.0, lines=1, light=90.0):
    """A disc drawn out along a way (2,) px with a bend (2,) px, sixty stations; over a background of 30, noise of 2."""
    y, x = np.mgrid[:90:lines, :90]
    t = np.linspace(-0.5, 0.5, 60)
    off = np.hypot(*(z[..., None] - 45 - t * w - t**2 * b for z, w, b in zip((x, y), way, bend, strict=True)))
    share = np.clip((radius - off) / 2 + 0.5, 0, 1).mean(axis=-1)
    return (30 + light * share + np.random.default_rng(1).normal(0, 2, x.shape)).astype(np.float32)


def left(grey, lines=1):
    over = grey - np.float32(30)
    blob = over > over.max() / 2
    return streak_left(over, np.ones(over.shape, bool), blob, lines)


@pytest.mark.parametrize(
    ("way", "bend", "radius", "lines"),
    [((10, 5), (0, 0), 5.0, 1), ((25, -12), (3, 6), 4.0, 1), ((12, 14), (0, 0), 6.0, 2)],
)
def test_a_streak_leaves_the_noise_and_is_no_three_discs(way, bend, radius, lines):
    """The first is one that three discs explain within its noise."""
    grey = streak(way, bend, radius, lines)
    assert left(grey, lines) < 2.1
    clump = clump_at(grey, np.zeros(grey.shape, bool), 45.0, 45.0 / lines, 0.8 * (grey.max() - 30), 2.0, lines)
    assert clump is not None
    assert three_discs(clump) is None


def test_three_discs_are_no_streak():
    row = [[33.0, 41.0], [45.0, 45.0], [57.0, 49.0]]
    assert min(left(window(at)) for at in (row, round_about(1.0), round_about(1.6))) > 8


def test_a_point_that_is_drawn_out_has_the_second_moments_of_its_way():
    velocity = np.array([[3.0, -2.0, 0.0], [1.0, 4.0, 0.0]])
    way = velocity[:, :, None] * np.linspace(-0.5, 0.5, 20_001)
    wanted = [(way[i] * way[j]).mean(axis=-1) for i, j in ((0, 0), (1, 1), (0, 1))]
    np.testing.assert_allclose(drawn_out(velocity), wanted, atol=1e-3)
