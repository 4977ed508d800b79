"""Centroids of drawn discs against their true places."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.discs import disc, windows
from vidtrack.tracking.centroiding.background import background_plane, sums_of
from vidtrack.tracking.centroiding.centroid import measure
from vidtrack.tracking.centroiding.components import Windows, components, cut
from vidtrack.tracking.centroiding.moments import soft_edge, weighted


def measured(stack, *, threshold=130.0, kind="weighted", noise=3.0, scale=1.0, chosen=None):
    n = stack.shape[1]
    zero = np.zeros(n, np.intp)
    view = Windows(stack, zero, zero, scale)
    found = components(view, threshold)
    if chosen is None:  # the component nearest to the middle of its window
        middle = (stack.shape[0] - 1) / 2
        off = np.hypot(found.x - middle, found.y - middle)
        order = np.lexsort((off, found.window))
        window, first = np.unique(found.window[order], return_index=True)
        chosen = np.full(n, -1)
        chosen[window] = order[first]
    return measure(view, found, chosen, noise=noise, kind=kind, threshold=threshold)


def errors(c, truth):
    return np.stack([c.x, c.y], axis=1) - truth


@pytest.fixture(scope="module")
def balls():
    return windows(1500, 4.0)


def test_a_ball_of_radius_4_is_placed_to_a_hundredth_of_a_pixel_without_bias(balls):
    """Contrast 200, noise 3: the noise alone gives 0.0066 px over the disc itself and 0.0087 with its soft edge."""
    stack, truth = balls
    error = errors(measured(stack), truth)
    rms = np.sqrt((error**2).mean(axis=0))
    assert (rms < 0.010).all()
    assert (rms > 0.006).all()
    assert (np.abs(error.mean(axis=0)) < 0.001).all()


@pytest.mark.parametrize(("radius", "least", "most"), [(1.5, 0.010, 0.03), (2.5, 0.006, 0.02), (6.0, 0.004, 0.01)])
def test_tiny_and_large_balls_are_placed_as_well_as_their_light_allows(radius, least, most):
    stack, truth = windows(800, radius)
    rms = np.sqrt((errors(measured(stack), truth) ** 2).mean(axis=0))
    assert (rms < most).all()
    assert (rms > least).all()


def test_the_standard_deviation_says_what_the_error_is(balls):
    stack, truth = balls
    c = measured(stack)
    ratio = errors(c, truth) / np.stack([c.sd_x, c.sd_y], axis=1)
    assert (np.abs(ratio.std(axis=0) - 1) < 0.12).all()


def test_binary_is_the_plain_mean_of_the_pixels_above_the_threshold():
    """Equations 4.2.1 and 4.2.2 on paper: pixels at x = 5, 6, 6 and y = 4, 4, 5."""
    window = np.zeros((16, 1, 16), np.uint8)
    window[4, 0, 5] = window[4, 0, 6] = window[5, 0, 6] = 200
    c = measured(window, kind="binary")
    assert c.pixels[0] == 3
    assert (c.x[0], c.y[0]) == pytest.approx((17 / 3, 13 / 3))


def test_binary_is_ten_times_worse_than_weighted_but_knows_it(balls):
    stack, truth = balls
    c = measured(stack, kind="binary")
    rms = np.sqrt((errors(c, truth) ** 2).mean(axis=0))
    assert (rms > 0.04).all()
    assert (rms < 0.12).all()
    assert (c.sd_x.mean() < 2 * rms).all()
    assert (c.sd_x.mean() > rms / 2).all()


def test_a_neighbour_in_the_window_does_not_pull():
    stack, truth = windows(300, 4.0)
    neighbour = 200 * disc((32, 32), 27.3, 20.4, 3.0)
    beside = np.clip(stack + neighbour[:, None], 0, 255).astype(np.uint8)
    shift = errors(measured(beside), truth) - errors(measured(stack), truth)
    assert np.abs(shift.mean(axis=0)).max() < 0.003


def test_an_unmasked_mean_would_be_pulled_by_that_neighbour():
    stack, truth = windows(50, 4.0, noise=0.0)
    x = np.arange(32)
    beside = stack + 200 * disc((32, 32), 27.3, 20.4, 3.0)[:, None]
    light = beside.astype(float) - 30
    naive = (light * x).sum((0, 2)) / light.sum((0, 2))
    assert np.abs(naive - truth[:, 0]).min() > 1


@pytest.mark.parametrize("slope", [(1.0, 0.0), (0.6, -0.8)])
def test_an_uneven_background_does_not_pull(slope):
    """A slope of 1 grey level/px would move a centroid by 0.07 px or more if it stayed in."""
    stack, truth = windows(400, 4.0, slope=slope, level=60, contrast=150)
    error = errors(measured(stack, threshold=135.0), truth)
    assert (np.abs(error.mean(axis=0)) < 0.003).all()
    assert (np.sqrt((error**2).mean(axis=0)) < 0.014).all()


def test_a_dim_rope_beside_the_target_does_not_tilt_the_background():
    """A rope of 40 grey levels along one side of the window, below the threshold."""
    stack, truth = windows(300, 4.0)
    roped = stack.copy()
    roped[:, :, 2:6] = np.clip(stack[:, :, 2:6].astype(int) + 40, 0, 255)
    shift = errors(measured(roped), truth) - errors(measured(stack), truth)
    assert np.abs(shift.mean(axis=0)).max() < 0.004


@pytest.mark.slow
def test_a_blurred_ball_is_placed_without_pixel_locking():
    stack, truth = windows(1500, 4.0, blur=1.0, noise=1.0)
    error = errors(measured(stack, noise=1.0), truth)[:, 0]
    fraction = truth[:, 0] % 1
    means = [error[(fraction >= low) & (fraction < low + 0.1)].mean() for low in np.arange(0, 1, 0.1)]
    assert np.abs(means).max() < 0.004


def test_ten_bits_and_eight_bits_agree():
    stack, _ = windows(50, 4.0)
    deep = np.rint(stack * (1023 / 255)).astype(np.uint16)
    a, b = measured(stack), measured(deep, scale=255 / 1023)
    assert a.x == pytest.approx(b.x, abs=4e-3)
    assert a.mass == pytest.approx(b.mass, rel=4e-3)
    assert a.contrast.mean() == pytest.approx(b.contrast.mean(), rel=0.01)


def test_saturated_targets_are_told_and_an_ellipse_finds_them():
    stack, truth = windows(200, 6.0, contrast=240.0)
    weighted, fitted = measured(stack), measured(stack, kind="ellipse")
    assert weighted.saturated.all()
    assert not measured(windows(20, 4.0)[0]).saturated.any()
    rms = [np.sqrt((errors(c, truth) ** 2).mean()) for c in (fitted, weighted)]
    assert rms[0] < rms[1] < 0.01


@pytest.mark.slow
def test_fitting_an_ellipse_to_tiny_targets_beats_weighting():
    stack, truth = windows(600, 1.5, noise=5.0)
    rms = {kind: np.sqrt((errors(measured(stack, kind=kind), truth) ** 2).mean()) for kind in ("ellipse", "weighted")}
    assert rms["ellipse"] < rms["weighted"] < 0.06


def test_no_component_gives_nan():
    stack, _ = windows(3, 4.0)
    view = Windows(stack, np.zeros(3, np.intp), np.zeros(3, np.intp), 1.0)
    found = components(view, 130.0)
    c = measure(view, found, np.array([0, -1, 2]), noise=3.0, threshold=130.0)
    assert np.isnan([c.x[1], c.y[1], c.sd_x[1], c.mass[1]]).all()
    assert c.pixels[1] == 0
    assert np.isfinite(c.x[[0, 2]]).all()


def test_windows_are_cut_where_they_should_be():
    image = np.arange(600, dtype=np.uint16).reshape(20, 30)
    pieces = cut(image[:, :25], np.array([0, 20]), np.array([3, 15]), 5, 4)
    assert pieces.shape == (4, 2, 5)
    assert (pieces[:, 1] == image[15:19, 20:25]).all()


@given(st.integers(-5, 5), st.integers(-5, 5), st.floats(2.0, 5.0), st.floats(40, 200))
@settings(max_examples=30, deadline=None)
def test_moving_a_ball_by_whole_pixels_moves_its_centroid_by_as_much(dx, dy, radius, contrast):
    place = np.array([16.3, 15.8])
    both = np.stack([disc((32, 32), *at, radius) for at in (place, place + np.array([dx, dy]))], axis=1)
    stack = np.rint(20 + contrast * both).astype(np.uint8)
    c = measured(stack, threshold=20 + contrast / 2, noise=0.3)
    assert c.x[1] - c.x[0] == pytest.approx(dx, abs=2e-3)
    assert c.y[1] - c.y[0] == pytest.approx(dy, abs=2e-3)


@given(st.floats(1.6, 5.0), st.floats(0, 1), st.floats(0, 1))
@settings(max_examples=30, deadline=None)
def test_turning_the_picture_turns_the_centroid(radius, x, y):
    stack = np.rint(30 + 180 * disc((30, 30), 14 + x, 14 + y, radius)).astype(np.uint8)[:, None]
    a, b = measured(stack, threshold=120), measured(np.ascontiguousarray(stack.transpose(2, 1, 0)), threshold=120)
    assert a.x == pytest.approx(b.y, abs=1e-3)
    assert a.y == pytest.approx(b.x, abs=1e-3)


def at_full_scale(pixels):
    """One disc of some 60 pixels above the threshold, of which so many are at full scale."""
    stack, _ = windows(1, 4.0, noise=0.0, contrast=200.0)
    middle = stack.shape[0] // 2
    flat = np.flatnonzero(stack[middle - 2 : middle + 3, 0, middle - 2 : middle + 3].ravel() > 200)[:pixels]
    rows, columns = np.unravel_index(flat, (5, 5))
    stack[middle - 2 + rows, 0, middle - 2 + columns] = 255
    return stack


@pytest.mark.parametrize(("pixels", "told"), [(0, False), (2, False), (3, True), (10, True)])
def test_a_twentieth_of_its_pixels_at_full_scale_saturates_a_target(pixels, told):
    c = measured(at_full_scale(pixels))
    assert 45 <= c.pixels[0] <= 56
    assert bool(c.saturated[0]) is told


def test_pull_is_what_the_things_left_out_of_the_background_would_have_moved_the_centroid_by():
    """A line of one px along one side, too thin for a neighbour; a larger target is pulled by the same tilt further."""
    for radius in (3.0, 6.0):
        stack, _ = windows(40, radius, side=36, noise=1.0)
        stack[:, :, 4] = np.clip(stack[:, :, 4].astype(int) + 60, 0, 255)
        zero = np.zeros(40, np.intp)
        view = Windows(stack, zero, zero, 1.0)
        found = components(view, 130.0)
        sums = sums_of(36, 36)
        grey = np.zeros(found.mask.shape, np.float32)
        grey[..., :36] = stack
        plane = background_plane(grey, found.mask, sums, 1.0)
        region = soft_edge((grey > 50).view(np.uint8), found.mask, None)
        x, y, *_ = weighted(grey, region, plane, sums)
        tilted = plane._replace(slope=plane.slope + plane.tilt)
        x_pulled, y_pulled, *_ = weighted(grey, region, tilted, sums)
        pulled = np.maximum(np.abs(x_pulled - x), np.abs(y_pulled - y))
        assert pulled.min() > 0.003
        assert np.median(measured(stack, noise=1.0).pull / pulled) == pytest.approx(1, abs=0.25)


def test_the_sd_holds_what_the_plane_does_not_know():
    """A large ball in a small window: few pixels are left for the background, and its slope counts as much as noise."""
    stack, truth = windows(1500, 7.0, side=23, noise=5.0)
    c = measured(stack, noise=5.0)
    z = errors(c, truth) / np.stack([c.sd_x, c.sd_y], axis=1)
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1, abs=0.12)
    of_noise = c.noise / c.mass * np.sqrt(np.pi / 4 * (7 + c.soft) ** 4)
    assert np.median(c.sd_x / of_noise) > 1.2
