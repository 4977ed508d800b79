"""The plane beneath a target: numpy's least squares with a gentle pull, its noise, and what stands in it left out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.tracking.centroiding.background import SURROUNDINGS, Sums, background_plane, on_grid, plane_under
from vidtrack.tracking.centroiding.components import CUTTING

SIDE = 32


def grids(side=SIDE):
    return np.meshgrid(np.arange(side) - (side - 1) / 2, np.arange(side) - (side - 1) / 2)


def stacked(pictures):
    """(side, n, side + separator) float32 of pictures (side, side)."""
    raw = np.stack(pictures, axis=1).astype(np.float32)
    return np.concatenate([raw, np.zeros((*raw.shape[:2], CUTTING.separator), np.float32)], axis=-1)


def planes(coefficients, noise=0.0, seed=0):
    x, y = grids()
    rng = np.random.default_rng(seed)
    return stacked([a + b * x + c * y + rng.normal(0, noise, x.shape) for a, b, c in coefficients])


def nothing(grey):
    return np.zeros(grey.shape, np.uint8)


levels = st.tuples(st.floats(10, 200), st.floats(-2, 2), st.floats(-2, 2))


@settings(max_examples=25, deadline=None)
@given(st.lists(levels, min_size=1, max_size=3))
def test_a_plane_is_that_plane(coefficients):
    plane = background_plane(planes(coefficients), nothing(planes(coefficients)), Sums(SIDE, SIDE), 1.0)
    np.testing.assert_allclose(plane.slope.T, coefficients, atol=0.02 + 0.01 * np.abs(coefficients).max())
    np.testing.assert_allclose(plane.value, [a for a, _, _ in coefficients], atol=0.02)


def test_it_is_numpy_s_least_squares_with_a_pull_of_the_slope_to_zero():
    """Ridge regression: two rows more, sqrt(prior) in the columns of the slopes about the pixels' middle."""
    grey = planes([(60, 0.4, -0.3)], noise=5.0)
    outside = np.ones_like(grey)[SURROUNDINGS.rows]
    outside[..., SIDE:] = 0
    outside[4:9, 0, 5:20] = 0
    plane = plane_under(grey[SURROUNDINGS.rows], outside, Sums(SIDE, SIDE))
    x, y = (axis[SURROUNDINGS.rows][outside[:, 0, :SIDE] > 0] for axis in grids())
    z = grey[SURROUNDINGS.rows][:, 0, :SIDE][outside[:, 0, :SIDE] > 0]
    pull = np.sqrt(SURROUNDINGS.slope_prior_px2)
    A = np.column_stack([np.ones_like(x), x - x.mean(), y - y.mean()])
    A = np.vstack([A, [0, pull, 0], [0, 0, pull]])
    mean, b, c = np.linalg.lstsq(A, np.append(z, [0, 0]), rcond=None)[0]
    np.testing.assert_allclose(plane.slope[:, 0], [mean - b * x.mean() - c * y.mean(), b, c], rtol=1e-3)
    covariance = np.linalg.inv(A.T @ A)
    np.testing.assert_allclose(plane.variance[:, 0], np.diag(covariance)[1:], rtol=1e-3)
    residual = z - np.column_stack([np.ones_like(x), x, y]) @ plane.slope[:, 0]
    assert plane.noise[0] == pytest.approx(np.sqrt((residual**2).sum() / (z.size - 3)), rel=0.01)


@pytest.mark.parametrize("noise", [1.0, 4.0, 12.0])
def test_its_noise_is_the_noise_of_the_pixels(noise):
    grey = planes([(90, 0, 0)] * 40, noise=noise)
    plane = background_plane(grey, nothing(grey), Sums(SIDE, SIDE), noise)
    assert plane.noise.mean() == pytest.approx(noise, rel=0.02)
    np.testing.assert_array_equal(plane.unrest, plane.noise)
    assert not plane.tilt.any()


def test_a_picture_without_noise_has_that_of_whole_grey_levels():
    grey = planes([(90, 0, 0)])
    assert background_plane(grey, nothing(grey), Sums(SIDE, SIDE), 1.0).noise[0] == pytest.approx(12**-0.5)


def test_the_target_and_three_pixels_about_it_are_no_background():
    grey = planes([(40, 0, 0)])
    grey[12:20, 0, 12:20] = 250
    grey[9:23, 0, 9:23] = np.maximum(grey[9:23, 0, 9:23], 120)
    mask = nothing(grey)
    mask[12:20, 0, 12:20] = 1
    assert background_plane(grey, mask, Sums(SIDE, SIDE), 1.0).value[0] == pytest.approx(40, abs=0.01)


def test_a_rope_across_the_window_is_left_out_and_said():
    grey = planes([(40, 0, 0), (40, 0, 0)], noise=1.0)
    grey[:, 0, 3:6] += 60
    plane = background_plane(grey, nothing(grey), Sums(SIDE, SIDE), 1.0)
    assert plane.value[0] == pytest.approx(40, abs=1.0)
    assert plane.noise[0] < 2
    assert plane.unrest[0] > 10
    assert abs(plane.tilt[0, 0]) > 3
    assert plane.unrest[1] == plane.noise[1]
    assert not plane.tilt[:, 1].any()


def test_without_any_pixel_the_plane_is_flat_and_finite():
    grey = planes([(40, 0, 0)])
    mask = np.ones(grey.shape, np.uint8)
    plane = background_plane(grey, mask, Sums(SIDE, SIDE), 1.0)
    assert np.isfinite(plane.slope).all()
    assert not plane.slope[1:].any()


def test_on_the_grid_it_is_the_plane_of_every_window():
    slope = np.array([[40.0, 50.0], [0.5, 0.0], [-0.25, 1.0]])
    x, y = grids()
    got = on_grid(slope, Sums(SIDE, SIDE))
    for k, (a, b, c) in enumerate(slope.T):
        np.testing.assert_allclose(got[:, k, :SIDE], a + b * x + c * y, rtol=1e-5)
    np.testing.assert_array_equal(on_grid(slope, Sums(SIDE, SIDE), SURROUNDINGS.rows), got[SURROUNDINGS.rows])
