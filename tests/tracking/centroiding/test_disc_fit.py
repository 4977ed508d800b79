"""Soft discs fitted to drawn windows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from tests.discs import windows
from vidtrack.tracking.centroiding.disc_fit import fit_soft_discs

SIDE = 32


def blurred_windows(n, radius, *, side, noise, contrast, blur, fine=6):
    """As `windows`, with the blur of a lens: before the pixels sample it."""
    rng = np.random.default_rng(0)
    truth = side // 2 + rng.uniform(-0.5, 0.5, (n, 2))
    at = (np.arange(side * fine) + 0.5) / fine - 0.5
    away = np.hypot(at[:, None] - truth[:, 1, None, None], at - truth[:, 0, None, None])
    share = np.clip((radius - away) * fine + 0.5, 0, 1)
    if blur:
        share = gaussian_filter(share, (0, blur * fine, blur * fine), truncate=5)
    pixels = share.reshape(n, side, fine, side, fine).mean(axis=(2, 4)).transpose(1, 0, 2)
    image = 30.0 + contrast * pixels + rng.normal(0, noise, pixels.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), truth


def fitted(stack, *, radius, start=(0.0, 0.0), contrast=200.0, noise=2.0):
    side, n = stack.shape[0], stack.shape[1]
    one = np.ones(n)
    return fit_soft_discs(
        stack.astype(float) - 30.0,
        np.ones(stack.shape),
        stack >= 255,
        middle=(side / 2, side / 2),
        x=start[0] * one,
        y=start[1] * one,
        radius=radius * one,
        contrast=contrast * one,
        noise=noise * one,
    )


def errors(found, truth, side=SIDE):
    return np.stack([found.x, found.y], axis=-1) + side / 2 - truth


@pytest.mark.parametrize(("noise", "contrast"), [(1.0, 220.0), (1.0, 60.0), (3.0, 60.0), (10.0, 200.0)])
@pytest.mark.parametrize("blur", [0.0, 0.3, 0.7, 1.5])
@pytest.mark.parametrize("radius", [1.0, 1.5, 2.5, 5.0, 12.0])
def test_the_middle_of_a_disc_is_found_as_well_as_its_sigma_says(radius, blur, noise, contrast):
    n, side = 24 if radius > 10 else 100, 2 * int(np.ceil(radius + 3 * blur)) + 10
    stack, truth = blurred_windows(n, radius, side=side, noise=noise, contrast=contrast, blur=blur)
    found = fitted(stack, radius=radius, contrast=contrast, noise=noise)
    off = errors(found, truth, side) / np.stack([found.sd_x, found.sd_y], axis=-1)
    assert np.isnan(off).mean() < 0.03
    # of a perfectly sharp edge pixels see less than there is: its sigma is on the safe side
    assert (0.72 if blur else 0.45) < np.sqrt(np.nanmean(off**2)) < 1.3


@pytest.mark.parametrize("blur", [0.0, 1.0])
def test_the_light_of_a_disc_is_its_area_times_its_contrast_however_blurred(blur):
    stack, _ = windows(50, 5.0, noise=1.0, blur=blur)
    assert fitted(stack, radius=5.0).mass.mean() == pytest.approx(200 * np.pi * 25, rel=0.01)


def test_pixels_at_full_scale_only_say_that_the_disc_is_not_below():
    """Cut off at 180 in the right half only: taken as they are, these pixels draw the middle aside."""
    stack, truth = windows(50, 4.0, noise=1.0, blur=1.2, contrast=200.0)
    cut = stack.copy()
    cut[:, :, SIDE // 2 :] = np.minimum(cut[:, :, SIDE // 2 :], 180)
    half = np.zeros(stack.shape, bool)
    half[:, :, SIDE // 2 :] = cut[:, :, SIDE // 2 :] >= 180
    one = np.ones(50)
    known = {"middle": (SIDE / 2, SIDE / 2), "x": 0 * one, "y": 0 * one, "radius": 4 * one}
    known |= {"contrast": 200 * one, "noise": one}
    aware = fit_soft_discs(cut - 30.0, np.ones(cut.shape), half, **known)
    blind = fit_soft_discs(cut - 30.0, np.ones(cut.shape), np.zeros(cut.shape, bool), **known)
    assert np.abs(errors(aware, truth)).max() < 0.05
    assert np.abs(errors(blind, truth)[:, 0].mean()) > 2 * np.abs(errors(aware, truth)[:, 0].mean())


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 5), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_answer_does_not_depend_on_where_the_fit_begins(seed, x, y):
    stack, _ = windows(4, 3.0, noise=2.0, seed=seed)
    a, b = fitted(stack, radius=3.0), fitted(stack, radius=3.0, start=(x, y))
    assert np.abs(np.subtract([a.x, a.y], [b.x, b.y])).max() < 0.01


def test_a_fit_that_runs_away_or_begins_nowhere_is_nan_and_leaves_the_others_alone():
    stack, _ = windows(3, 3.0, noise=2.0)
    stack = stack.copy()
    far = np.roll(stack[:, 0], 8, axis=1)
    stack[:, 0] = far
    start = (np.array([0.0, np.nan, 0.0]), np.zeros(3))
    found = fitted(stack, radius=3.0, start=start)
    alone = fitted(stack[:, 2:], radius=3.0)
    assert np.isnan(np.stack(found)[:, :2]).all()
    assert found.x[2] == pytest.approx(alone.x[0], abs=1e-5)


def test_rounding_of_where_a_fit_begins_does_not_move_its_end():
    """Processors round sums otherwise: an end that follows them would differ from one to the next."""
    stack, _ = blurred_windows(40, 2.5, side=24, noise=2.0, contrast=150.0, blur=0.7)
    one, two = (fitted(stack, radius=2.5, contrast=150.0, start=(0.2 + part, -0.1)) for part in (0.0, 1e-8))
    for a, b, scale in zip(one, two, (1, 1, 1, 1, 1e4), strict=True):
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * scale)
