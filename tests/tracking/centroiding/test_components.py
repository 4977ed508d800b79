"""Connected patches in many windows at once are those of scipy in each window alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from vidtrack.tracking.centroiding.components import CUTTING, Windows, above, components, components_of, cut, own_pixels

EIGHT = np.ones((3, 3))


def random_windows(seed, n=4, height=9, width=11, share=0.3):
    rng = np.random.default_rng(seed)
    raw = (rng.random((height, n, width)) < share).astype(np.uint8) * 200
    return Windows(raw, rng.integers(0, 50, n), rng.integers(0, 50, n), 1.0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.6))
def test_patches_are_scipy_s_in_each_window_alone(seed, share):
    windows = random_windows(seed, share=share)
    found = components(windows, 100)
    height, n, width = windows.raw.shape
    assert found.mask.shape == (height, n, width + CUTTING.separator)
    for k in range(n):
        labels, m = ndimage.label(windows.raw[:, k] > 100, EIGHT)
        own = np.flatnonzero(found.window == k)
        assert own.size == m
        wanted = sorted(
            (columns.mean(), rows.mean(), rows.size, columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1)
            for rows, columns in (np.nonzero(labels == label) for label in range(1, m + 1))
        )
        left, top = windows.left[k], windows.top[k]
        got = sorted(
            zip(
                found.x[own] - left,
                found.y[own] - top,
                found.pixels[own],
                found.left[own] - left,
                found.top[own] - top,
                found.width[own],
                found.height[own],
                strict=True,
            )
        )
        np.testing.assert_allclose(got, np.array(wanted, float).reshape(len(got), 7) if wanted else got)


def test_the_pixels_of_the_chosen_patch_are_its_own_and_none_is_chosen_by_minus_one():
    windows = random_windows(3)
    found = components(windows, 100)
    chosen = np.array([np.flatnonzero(found.window == k)[0] for k in range(4)])
    chosen[2] = -1
    own = own_pixels(found, chosen)
    assert not own[:, 2].any()
    for k in (0, 1, 3):
        assert own[:, k].sum() == found.pixels[chosen[k]]
        _, columns = np.nonzero(own[:, k])
        assert columns.mean() + windows.left[k] == pytest.approx(found.x[chosen[k]])


@settings(max_examples=40)
@given(st.floats(0, 300), st.sampled_from([(np.uint8, 255), (np.uint16, 1023), (np.float32, 255)]))
def test_a_pixel_is_above_the_threshold_in_grey_levels_of_any_depth(threshold, kind):
    dtype, full = kind
    raw = np.linspace(0, full, 60).astype(dtype).reshape(3, 2, 10)
    windows = Windows(raw, np.zeros(2, int), np.zeros(2, int), 255 / full)
    level = np.float32(threshold / windows.scale) if dtype is np.float32 else threshold / windows.scale
    np.testing.assert_array_equal(above(windows, threshold), raw > level)


def test_each_window_may_have_a_threshold_of_its_own():
    raw = np.full((2, 3, 4), 100, np.uint8)
    windows = Windows(raw, np.zeros(3, int), np.zeros(3, int), 1.0)
    np.testing.assert_array_equal(above(windows, [50.0, 100.0, 99.5]).all((0, 2)), [True, False, True])


def test_windows_are_cut_where_they_are_asked_for_at_the_very_edge_too():
    image = np.arange(20 * 30, dtype=np.uint16).reshape(20, 30)
    left, top = np.array([0, 22, 7]), np.array([0, 15, 9])
    got = cut(image, left, top, 8, 5)
    assert got.shape == (5, 3, 8)
    for k in range(3):
        np.testing.assert_array_equal(got[:, k], image[top[k] : top[k] + 5, left[k] : left[k] + 8])
    got[:] = 0
    assert image[15, 22] == 15 * 30 + 22


def test_patches_that_meet_the_edge_of_a_window_do_not_join_with_those_of_the_next():
    raw = np.zeros((4, 2, 5), np.uint8)
    raw[:, 0, 4] = raw[:, 1, 0] = 200
    found = components(Windows(raw, np.array([0, 5]), np.zeros(2, int), 1.0), 100)
    assert found.window.tolist() == [0, 1]
    assert found.left.tolist() == [4, 5]


def test_very_many_patches_are_all_numbered():
    marked = np.zeros((600, 1, 1200), bool)
    marked[::2, 0, ::2] = True
    found = components_of(marked, Windows(marked.view(np.uint8), np.zeros(1, int), np.zeros(1, int), 1.0))
    assert found.pixels.size == 300 * 600
    assert (found.pixels == 1).all()
