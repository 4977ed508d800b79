"""The weights of a template on paper, and on drawn discs without noise."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tests.discs import disc
from vidtrack.tracking.centroiding.template_weights import cut_light, weights


def test_weights_are_right_on_paper():
    """A uniform picture has no mass; a slope has none either; one bright pixel at (1, 0) is where it is."""
    w = weights(10, 10)
    y, x = np.mgrid[: w.height, : w.width] - np.array([w.height // 2, w.width // 2])[:, None, None]
    assert (7 + 2 * x + 3 * y).ravel() @ w.linear == pytest.approx((0, 0, 0, 7, *[0] * 9), abs=2e-3)
    one = ((x == 1) & (y == 0)).ravel().astype(float)
    assert one @ w.linear[:, :3] == pytest.approx((1, 1, 0), abs=1e-6)
    assert one @ w.linear[:, 8:11] == pytest.approx((1, 0, 0), abs=1e-6)


@pytest.mark.parametrize(("radius", "blur", "twice"), [(5.0, 1.5, 15), (5.0, 1.0, 15), (3.0, 0.7, 11), (12.0, 1.5, 29)])
def test_the_middle_of_a_disc_whose_edge_the_mask_cuts_is_where_it_is(radius, blur, twice):
    """Weighted alone, it would be up to 0.05 px nearer to the middle of the mask."""
    w = weights(twice, twice)
    for x, y in ((0.25, 0.0), (0.5, 0.0), (0.5, 0.5)):
        fine = disc((5 * w.height, 5 * w.width), 5 * (w.width // 2 + x) + 2, 5 * (w.height // 2 + y) + 2, 5 * radius)
        image = gaussian_filter(fine, 5 * blur).reshape(w.height, 5, w.width, 5).mean(axis=(1, 3))
        mass, m_x, m_y, *_, inside, outside = image.ravel() @ w.linear
        whole = mass - cut_light(inside, outside, np.array([m_x, m_y]) / mass)
        assert (m_x / whole, m_y / whole) == pytest.approx((x, y), abs=0.003)


def test_no_light_at_the_outline_cuts_nothing():
    assert cut_light(np.array(-1.0), np.array(0.5), np.zeros(2)) == pytest.approx(0.0, abs=1e-8)


def test_what_may_be_noise_cuts_nothing():
    """A ball in plain view was 0.0027 px worse for it in every sample."""
    off, inside = np.array([0.3, 0.3]), np.array(0.05)
    sure, unsure = (cut_light(inside, np.array(0.006), off, noise) for noise in (1e-5, 6e-3))
    assert sure > 0.01
    assert unsure < 0.35 * sure
