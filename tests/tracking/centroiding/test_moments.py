"""Moments over all windows at once, against the same sums pixel by pixel and against repeated noise."""

import numpy as np
import pytest

from tests.discs import disc, windows
from vidtrack.tracking.centroiding.background import Sums, background_plane
from vidtrack.tracking.centroiding.components import CUTTING, Windows, components, own_pixels
from vidtrack.tracking.centroiding.moments import binary, plateau_of, soft_edge, weighted

SIDE, N = 32, 12


def measured(raw, threshold=130.0, noise=3.0):
    """grey, target, region, mask, plane, sums and the component's pixels of windows with one patch each."""
    side, n, width = raw.shape
    found = components(Windows(raw, np.zeros(n, np.intp), np.zeros(n, np.intp), 1.0), threshold)
    largest = np.full(n, -1)
    for k in np.argsort(found.pixels, kind="stable"):
        largest[found.window[k]] = k
    target = own_pixels(found, largest)
    grey = np.zeros((side, n, width + CUTTING.separator), np.float32)
    grey[..., :width] = raw
    sums = Sums(side, width)
    plane = background_plane(grey, found.mask, sums, noise)
    region = soft_edge(found.mask, target, found.mask)
    return grey, target, region, found.mask, plane, sums, found.pixels[largest]


def test_the_sums_are_those_of_a_loop_over_pixels():
    rng = np.random.default_rng(0)
    weight = rng.normal(size=(7, 3, 9 + CUTTING.separator)).astype(np.float32)
    got = Sums(7, 9).moments(weight)
    y, x = np.arange(7) - 3.0, np.arange(9 + CUTTING.separator) - 4.0
    for k in range(3):
        for m in range(3):
            wanted = np.einsum("hnw,h,w->n", weight.astype(float), y**k, x**m)
            np.testing.assert_allclose(got[k, m], wanted, rtol=1e-4, atol=1e-3)


def test_some_rows_are_those_rows():
    weight = np.random.default_rng(1).normal(size=(8, 2, 6 + CUTTING.separator)).astype(np.float32)
    only = np.zeros_like(weight)
    only[::2] = weight[::2]
    sums = Sums(8, 6)
    np.testing.assert_allclose(sums.moments(weight[::2], slice(0, None, 2)), sums.moments(only), rtol=1e-5, atol=1e-4)


def test_without_noise_the_weighted_centroid_is_the_disc_s_and_its_mass_the_disc_s_light():
    raw, truth = windows(N, 5.0, noise=0.0, side=SIDE)
    grey, _, region, _, plane, sums, _ = measured(raw)
    x, y, mass, _, _, area, xx, yy, xy = weighted(grey, region, plane, sums)
    middle = (SIDE - 1) / 2
    np.testing.assert_allclose(np.stack([x, y], -1) + middle, truth, atol=0.01)
    np.testing.assert_allclose(mass, 200 * np.pi * 25, rtol=0.01)
    assert (area > np.pi * 25).all()
    np.testing.assert_allclose(np.stack([xx, yy]), 25 / 4, rtol=0.04)
    np.testing.assert_allclose(xy, 0, atol=0.02)


def test_the_weighted_centroid_is_the_same_on_a_slope():
    flat = weighted_of(windows(N, 5.0, noise=0.0, side=SIDE)[0])
    tilted = weighted_of(windows(N, 5.0, noise=0.0, side=SIDE, slope=(1.0, -0.5))[0])
    np.testing.assert_allclose(tilted, flat, atol=0.02)


def weighted_of(raw):
    grey, _, region, _, plane, sums, _ = measured(raw)
    return np.stack(weighted(grey, region, plane, sums)[:2])


def test_sd_of_the_weighted_centroid_is_its_scatter():
    n = 400
    raw, truth = windows(n, 4.0, noise=4.0, side=SIDE, seed=3)
    grey, _, region, _, plane, sums, _ = measured(raw, noise=4.0)
    x, y, _, sd_x, sd_y, *_ = weighted(grey, region, plane, sums)
    z = (np.stack([x, y], -1) + (SIDE - 1) / 2 - truth) / np.stack([sd_x, sd_y], -1)
    assert np.mean(z**2) == pytest.approx(1, abs=0.25)


def test_the_binary_centroid_is_the_mean_of_the_pixels_above_the_threshold():
    """4.2.1 and 4.2.2, pixel by pixel."""
    raw, _ = windows(N, 5.0, side=SIDE)
    _, target, _, _, _, sums, pixels = measured(raw)
    x, y, _, _ = binary(target, sums)
    for k in range(N):
        rows, columns = np.nonzero(target[:, k])
        assert rows.size == pixels[k]
        assert x[k] + (SIDE - 1) / 2 == pytest.approx(columns.mean(), abs=1e-5)
        assert y[k] + (SIDE - 1) / 2 == pytest.approx(rows.mean(), abs=1e-5)


@pytest.mark.parametrize("radius", [3.0, 6.0])
def test_sd_of_the_binary_centroid_is_what_counting_whole_pixels_costs(radius):
    """Discs anywhere in a pixel, without noise: what is left is rounding to whole pixels."""
    raw, truth = windows(600, radius, noise=0.0, side=SIDE, seed=1)
    _, target, _, _, _, sums, _ = measured(raw)
    x, y, sd_x, sd_y = binary(target, sums)
    error = np.stack([x, y], -1) + (SIDE - 1) / 2 - truth
    assert np.sqrt(np.mean(error**2)) == pytest.approx(np.sqrt(np.mean(np.square([sd_x, sd_y]))), rel=0.35)


def test_a_window_without_a_target_has_no_centroid():
    raw = np.full((SIDE, 2, SIDE), 30, np.uint8)
    raw[10:16, 1, 10:16] = 200
    grey, target, region, _, plane, sums, _ = measured(raw)
    with np.errstate(invalid="ignore"):
        assert np.isnan(binary(target, sums)[0]).tolist() == [True, False]
    assert np.isfinite(weighted(grey, region, plane, sums)[0]).tolist() == [False, True]


def test_the_soft_edge_holds_all_of_a_blurred_target_and_never_the_next_window():
    shape = (SIDE, SIDE)
    soft = 30 + 200 * disc(shape, 15.5, 15.5, 5.0)
    low = np.zeros((SIDE, 1, SIDE + CUTTING.separator), np.uint8)
    target = low.copy()
    low[:, 0, :SIDE], target[:, 0, :SIDE] = soft > 50, soft > 130
    region = soft_edge(low, target, None)
    assert (region[:, 0, :SIDE] >= (soft > 31)).all()
    assert not region[..., SIDE:].any()
    assert set(np.unique(region)) <= {0, 1}
    grown = np.flatnonzero(region[16, 0]).size - np.flatnonzero(target[16, 0]).size
    assert grown <= 2 * 3


def test_pixels_beside_another_target_count_for_none():
    mask = np.zeros((SIDE, 1, SIDE + CUTTING.separator), np.uint8)
    target = mask.copy()
    target[12:18, 0, 8:14] = 1
    mask[:] = target
    mask[12:18, 0, 17:23] = 1  # three columns apart
    low = np.zeros_like(mask)
    low[10:20, 0, 6:25] = 1  # what lies between them is lit by both
    region = soft_edge(low, target, mask)
    assert not region[10:20, 0, 15:].any()
    assert region[15, 0, 5:15].all()
    assert not region[15, 0, :5].any()
    assert (region >= target).all()
    assert soft_edge(low, target, None)[15, 0, 16]
    assert not soft_edge(low, target, None)[15, 0, 17:].any()


def test_a_plateau_is_the_mean_level_over_the_background():
    raw = np.full((SIDE, 1, SIDE), 30, np.uint8)
    raw[10:16, 0, 10:16] = 200
    raw[10:13, 0, 10:16] = 180
    grey, target, _, _, plane, _, pixels = measured(raw, threshold=100.0)
    assert plateau_of(grey, target, plane, pixels)[0] == pytest.approx(160, abs=0.2)


def test_sd_of_the_binary_centroid_is_the_same_wherever_the_target_lies_in_its_window():
    raw = np.full((24, 2, 24), 30, np.uint8)
    raw[8:13, 0, 9:16] = raw[12:17, 1, 14:21] = 200
    _, target, _, _, _, sums, _ = measured(raw)
    _, _, sd_x, sd_y = binary(target, sums)
    np.testing.assert_allclose([sd_x[1], sd_y[1]], [sd_x[0], sd_y[0]], rtol=1e-5)


def test_an_unsure_slope_of_the_background_moves_the_centroid_by_the_square_of_the_region_s_spread():
    raw, _ = windows(4, 5.0, side=SIDE)
    grey, _, region, _, plane, sums, _ = measured(raw)
    sure = weighted(grey, region, plane._replace(variance=np.zeros_like(plane.variance)), sums)
    variance = np.broadcast_to([[1e-4], [3e-4]], plane.variance.shape)
    unsure = weighted(grey, region, plane._replace(variance=variance), sums)
    share = plane.noise / sure[2]
    for axis, at in enumerate((3, 4)):
        spread = (sure[at] / share) ** 2
        np.testing.assert_allclose(unsure[at] ** 2 - sure[at] ** 2, (share * spread) ** 2 * variance[axis], rtol=1e-4)
