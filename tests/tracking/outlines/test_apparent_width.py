"""A ball looks as wide as it is, in any light, focus and threshold."""

import cv2
import numpy as np
import pytest

from vidtrack.tracking.outlines.apparent_width import apparent_widths


def picture(at, diameter, *, level=150.0, ground=30.0, blur=0.7, noise=0.0, smear=0.0, lines=1, seed=0):
    """A disc, drawn 16 times as fine and averaged; smear: px along x that it moves meanwhile."""
    k = 16
    y, x = (np.mgrid[0 : 48 * k, 0 : 64 * k] + 0.5) / k - 0.5
    fine = (np.hypot(x - at[0], y - at[1]) < diameter / 2).astype(np.float32)
    grey = fine.reshape(48, k, 64, k).mean((1, 3))
    if smear:
        shifts = np.linspace(-smear / 2, smear / 2, 21)
        moved = [cv2.warpAffine(grey, np.float32([[1, 0, s], [0, 1, 0]]), (64, 48)) for s in shifts]
        grey = np.mean(moved, 0)
    grey = ground + level * cv2.GaussianBlur(grey, (0, 0), blur)
    return (grey + np.random.default_rng(seed).normal(0, noise, grey.shape))[::lines]


@pytest.mark.parametrize("diameter", [7.0, 9.3, 16.0])
@pytest.mark.parametrize("look", [{}, {"level": 80.0}, {"blur": 1.0}, {"smear": 2.0}])
def test_a_ball_looks_as_wide_as_it_is(diameter, look):
    at = (30.3, 22.6)
    (width,) = apparent_widths(picture(at, diameter, **look), [at], [np.pi * diameter**2 / 4])
    assert width == pytest.approx(diameter, rel=0.03)


def test_the_threshold_does_not_matter_and_a_percent_shows():
    at, pixels = (30.3, 22.6), np.pi * 9.3**2 / 4
    small, large = (picture(at, d) for d in (9.3, 9.3 * 1.01))
    width = apparent_widths(small, [at] * 3, [pixels, 0.85 * pixels, 1.15 * pixels])
    assert width == pytest.approx([width[0]] * 3, rel=0.01)
    assert apparent_widths(large, [at], [pixels * 1.02])[0] / width[0] == pytest.approx(1.01, abs=0.003)


def test_noise_and_place_scatter_by_less_than_a_percent():
    rng = np.random.default_rng(3)
    places = rng.uniform(-0.5, 0.5, (12, 2)) + np.array([30, 22])
    widths = [apparent_widths(picture(at, 9.3, noise=3.0, seed=i), [at], [68])[0] for i, at in enumerate(places)]
    assert np.std(widths) / np.mean(widths) < 0.01


def test_a_field_shows_the_same_width():
    at = (30.3, 22.0)
    (width,) = apparent_widths(picture(at, 16.0, lines=2), [(at[0], at[1] / 2)], [np.pi * 16**2 / 8], lines=2)
    assert width == pytest.approx(16.0, rel=0.03)


def test_what_is_no_ball_alone_has_no_width():
    at, pixels = (30.3, 22.6), 68
    beside = np.maximum(picture(at, 9.3), picture((39.5, 22.6), 5.0))
    assert np.isnan(apparent_widths(beside, [at], [pixels])).all()
    assert np.isnan(apparent_widths(picture(at, 9.3, level=230.0), [at], [pixels])).all()  # saturated
    assert np.isnan(apparent_widths(picture(at, 9.3, blur=3.0), [at], [pixels])).all()  # out of focus
    assert np.isnan(apparent_widths(picture(at, 9.3, level=10.0), [at], [pixels])).all()
    assert np.isnan(apparent_widths(picture((4.0, 22.0), 9.3), [(4.0, 22.0)], [pixels])).all()  # at the edge
    assert np.isnan(apparent_widths(picture(at, 9.3), [at, (np.nan, 1.0)], [6, 68])).all()  # few pixels, not measured


def test_balls_that_are_looked_at_with_much_larger_and_with_many_others_look_the_same():
    at, pixels, grey = (14.3, 22.6), np.pi * 9.3**2 / 4, picture((14.3, 22.6), 9.3)
    (alone,) = apparent_widths(grey, [at], [pixels])
    widths = apparent_widths(grey, [at] * 40 + [(32.0, 24.0)], [pixels] * 40 + [np.pi * 20.0**2])
    assert np.isfinite(alone)
    assert widths[:40] == pytest.approx([alone] * 40)
