"""Lenses of other programs put points where OpenCV's own projection puts them."""

import cv2
import numpy as np
import pytest

from vidtrack.geometry.brown import BrownLens, changed, distorted, undistorted

SIZE = (1280, 720)
MILD = BrownLens(1400.0, 1395.0, 650.2, 352.8, SIZE, (-0.11, 0.06, -0.01), 4e-4, -3e-4)
WIDE = BrownLens(620.0, 618.0, 645.0, 355.0, SIZE, (-0.02, 0.003, -0.001, 0.0002), fisheye=True)
RICH = BrownLens(1400.0, 1395.0, 650.2, 352.8, SIZE, (-0.1, 0.05, 0.01), 1e-4, 2e-4, (0.02, 0.01, 0.003))


def seen_by(lens, n=400, seed=0):
    """Points (n, 3) at many depths that the lens sees within its picture."""
    rng = np.random.default_rng(seed)
    b = rng.uniform([0, 0], [lens.image_size[0] - 1, lens.image_size[1] - 1], (n, 2))
    return np.concatenate([undistorted(lens, b), np.ones((n, 1))], -1) * rng.uniform(1, 9, (n, 1))


def by_opencv(lens, p):
    """Where OpenCV's own projection puts points (n, 3)."""
    K = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1.0]])
    zero = np.zeros(3)
    if lens.fisheye:
        return cv2.fisheye.projectPoints(p[None], zero, zero, K, np.array(lens.k))[0][0]
    k = [*lens.k, 0, 0, 0][:3]
    coefficients = np.array([k[0], k[1], lens.p1, lens.p2, k[2], *([*lens.denominator, 0, 0, 0][:3]), *lens.prism])
    return cv2.projectPoints(p, zero, zero, K, coefficients)[0][:, 0]


@pytest.mark.parametrize(
    "lens",
    [MILD, RICH, WIDE, MILD._replace(prism=(1e-3, -2e-4, 5e-4, 1e-4))],
    ids=["brown", "rational", "wide", "prism"],
)
def test_a_lens_puts_points_where_opencv_puts_them(lens):
    p = seen_by(lens)
    np.testing.assert_allclose(distorted(lens, p[:, :2] / p[:, 2:]), by_opencv(lens, p), atol=1e-8)


@pytest.mark.parametrize("lens", [MILD, RICH, WIDE])
def test_undistorted_is_the_inverse_of_distorted(lens):
    p = seen_by(lens)
    x = p[:, :2] / p[:, 2:]
    np.testing.assert_allclose(undistorted(lens, distorted(lens, x)), x, atol=1e-12)


def test_positions_that_the_lens_cannot_see_are_nan():
    folding = MILD._replace(fx=700.0, fy=700.0, k=(-0.5, 0.0, 0.0))
    x = undistorted(folding, [[640.0, 350.0], [5.0, 5.0]])
    assert np.isfinite(x[0]).all()
    assert np.isnan(x[1]).all()


def test_one_number_of_a_lens_moves_alone():
    assert changed(MILD, "cx", 1.5) == MILD._replace(cx=651.7)
    assert changed(MILD._replace(k=()), "k2", 0.1).k == (0.0, 0.1)
    with pytest.raises(ValueError, match="k9"):
        changed(MILD, "k9", 0.1)
