"""A disc that something dark hides in part is measured within its sd by what is left; what is no disc is refused."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from vidtrack.tracking.discs.half_hidden import fit_half_hidden, usual_disc

NOISE, LIGHT, LEVEL = 2.5, 140.0, 30.0


def drawn(rng, radius, width, offset, *, front=8.0, size=(1.0, 1.0), edge=0.76, noise=NOISE):
    """Grey levels, the middle, and the share of a disc that a bar of `width` px, `offset` px off, leaves."""
    n = int(2 * radius + 24)
    x, y = n / 2 + rng.uniform(-0.5, 0.5, 2)
    row, column = np.mgrid[:n, :n].astype(float)
    away = np.hypot((column - x) / size[0], (row - y) / size[1])
    disc = ndtr((radius - away) / edge)
    angle = rng.uniform(0, np.pi)
    off = np.abs((column - x) * np.sin(angle) - (row - y) * np.cos(angle) - offset)
    bar = ndtr((width / 2 - off) / edge)
    light = LEVEL + LIGHT * disc
    light += bar * (front - light) + rng.normal(0, noise, light.shape)
    return np.rint(light).astype(np.float32), x, y, ((1 - bar) * disc).sum() / disc.sum()


def fitted(rng, grey, x, y, radius, *, roughly=1.5, beside=False):
    known = usual_disc(np.array([[np.pi * (radius * rng.normal(1, 0.01)) ** 2, LIGHT, 2 * radius, 2 * radius]]).T)
    at = np.array([x, y]) + rng.normal(0, roughly, 2)
    return fit_half_hidden(grey, np.zeros(grey.shape, bool), at[:1], at[1:], known, NOISE, beside=beside)[0]


@pytest.mark.parametrize("width", [3.0, 7.0])
def test_what_a_rope_or_a_mast_leaves_says_where_the_disc_is(width):
    rng = np.random.default_rng(4)
    z, seen, found = [], 0, 0
    for _ in range(9):
        radius = rng.uniform(8, 11)
        grey, x, y, shown = drawn(rng, radius, width, rng.uniform(3, radius))
        fit = fitted(rng, grey, x, y, radius)
        seen += shown > 0.7
        found += shown > 0.7 and fit is not None
        if fit is not None:
            z += [(fit.x[0] - x) / fit.sd_x[0], (fit.y[0] - y) / fit.sd_y[0]]
    assert found > 0.7 * seen > 2
    assert np.abs(z).max() < 4
    assert np.sqrt(np.mean(np.square(z))) < 1.3


def test_a_disc_of_which_too_little_is_left_and_what_is_no_disc_are_refused():
    rng = np.random.default_rng(2)
    for _ in range(2):
        grey, x, y, shown = drawn(rng, 6.0, 9.0, 0.0)
        assert shown < 0.3
        assert fitted(rng, grey, x, y, 6.0) is None
        grey, x, y, _ = drawn(rng, 6.0, 2.0, 20.0, size=(1.0, 0.7))  # another thing, as long
        assert fitted(rng, grey, x, y, 6.0) is None
        half, x, y, _ = drawn(rng, 6.0, 2.0, 20.0)
        column = np.arange(half.shape[1]) + np.zeros(half.shape)
        half[column > x] = LEVEL + 0.7 * (half[column > x] - LEVEL)  # a shadow is nothing in front
        assert fitted(rng, half, x, y, 6.0) is None


def test_a_disc_that_nothing_dark_hides_is_not_measured_here():
    rng = np.random.default_rng(3)
    grey, x, y, _ = drawn(rng, 6.0, 2.0, 20.0)
    assert fitted(rng, grey, x, y, 6.0) is None


def test_beside_something_dark_a_whole_disc_is_measured_where_that_is_asked_for():
    """A fit of discs alone counts what the rope takes off the background as its own error."""
    rng = np.random.default_rng(3)
    for _ in range(6):
        grey, x, y, shown = drawn(rng, 6.0, 3.0, 9.0)
        assert shown > 0.99
        assert fitted(rng, grey, x, y, 6.0) is None
        fit = fitted(rng, grey, x, y, 6.0, beside=True)
        assert np.abs([(fit.x[0] - x) / fit.sd_x[0], (fit.y[0] - y) / fit.sd_y[0]]).max() < 4
    grey, x, y, _ = drawn(rng, 6.0, 2.0, 20.0)  # too far off to matter
    assert fitted(rng, grey, x, y, 6.0, beside=True) is None


def test_two_that_touch_behind_a_rope_are_measured_within_their_sd():
    """Drawn with 16 points to a pixel, blurred by 0.7 px; middles 12 to 20 px apart, radius 9 px."""
    rng = np.random.default_rng(5)
    row, column = np.mgrid[:200, :240] / 4 - 0.375
    z, found = [], 0
    for gap in np.linspace(12, 20, 9):
        at = np.array([[29.5 - gap / 2, 25.0], [29.5 + gap / 2, 25.0]]) + rng.uniform(-0.5, 0.5, (2, 2))
        light = np.full(row.shape, LEVEL)
        for x, y in at:
            light[np.hypot(column - x, row - y) < 9] = LEVEL + LIGHT
        angle, (x, y) = rng.uniform(0, np.pi), rng.uniform((20, 20), (40, 30))
        light[np.abs((column - x) * np.sin(angle) - (row - y) * np.cos(angle)) < 2.5] = 8
        light = gaussian_filter(light, 2.8).reshape(50, 4, 60, 4).mean(axis=(1, 3))
        grey = np.rint(light + rng.normal(0, NOISE, light.shape)).astype(np.float32)
        known = usual_disc(np.array([[np.pi * 81, LIGHT, 18.0, 18.0]] * 2).T)
        fit = fit_half_hidden(grey, np.zeros(grey.shape, bool), *(at + rng.normal(0, 1, (2, 2))).T, known, NOISE)[0]
        if fit is not None:
            found += 1
            z += [(fit.x - at[:, 0]) / fit.sd_x, (fit.y - at[:, 1]) / fit.sd_y]
    assert found >= 6
    assert np.abs(z).max() < 4
    assert np.sqrt(np.mean(np.square(z))) < 1.3


def test_usual_looks_that_are_no_disc_or_not_known_say_no_shape():
    disc, part = [113.0, 140.0, 12.0, 12.0], [70.0, 140.0, 12.0, 12.0]
    assert np.exp(usual_disc(np.array([disc]).T).value[:2]) == pytest.approx(6.0, abs=0.01)
    assert usual_disc(np.array([[113.0, 140.0, 12.0, np.nan]]).T) is None
    assert usual_disc(np.array([part]).T) is None
    assert usual_disc(np.array([[70.0, 140.0, 12.0, 7.0]]).T) is None
    assert usual_disc(np.array([disc, part]).T) is None
    slim = [85.0, 140.0, 12.0, 9.0]  # alone it may be one, of two that touch it is not certain
    assert usual_disc(np.array([slim]).T) is not None
    assert usual_disc(np.array([disc, slim]).T) is None


def test_a_small_disc_with_a_rope_across_its_middle_is_measured_within_its_sd():
    """Of 5 px radius and a rope of 3 px no more is left than two caps, which lie on both sides of the middle."""
    rng = np.random.default_rng(5)
    z = []
    for _ in range(20):
        grey, x, y, shown = drawn(rng, rng.uniform(4.8, 5.4), 3.0, rng.uniform(-1, 1))
        assert 0.5 < shown < 0.75
        if (fit := fitted(rng, grey, x, y, 5.1, roughly=0.3, beside=True)) is not None:
            z += [(fit.x[0] - x) / fit.sd_x[0], (fit.y[0] - y) / fit.sd_y[0]]
    assert len(z) >= 2 * 14
    assert np.abs(z).max() < 4
    assert np.sqrt(np.mean(np.square(z))) < 1.3


def test_what_a_soft_edge_still_covers_two_pixels_off_is_no_part_of_the_disc():
    rng = np.random.default_rng(6)
    z = []
    for _ in range(40):
        radius = rng.uniform(4.5, 8)
        grey, x, y, _ = drawn(rng, radius, rng.uniform(3, 6.5), rng.uniform(0.6, 1.1) * radius, edge=1.04, noise=1.5)
        if (fit := fitted(rng, grey, x, y, radius, roughly=0.3, beside=True)) is not None:
            z += [(fit.x[0] - x) / fit.sd_x[0], (fit.y[0] - y) / fit.sd_y[0]]
    assert len(z) >= 40
    assert np.abs(z).max() < 4
    assert np.sqrt(np.mean(np.square(z))) < 1.2
