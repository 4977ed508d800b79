"""The middle of a ball's outline, compared with the cone that touches it, worked out without the code."""

import numpy as np
import pytest

from tests.geometry.underwater import LEFT
from tests.spheres import middle_and_area, touched
from vidtrack.geometry.ball_perspective import outline_offset
from vidtrack.geometry.camera import Camera, line_of_sight, project

PINHOLE = Camera(320.0, 240.0, 1.0, 1.0, 1.0, 900.0, 0.0, np.eye(3), np.zeros(3), (640, 480))
LENSES = {
    "barrel": {"kappa1": 1e-6},
    "pincushion": {"kappa1": -4e-7},
    "wide pixels": {"dx": 1.0, "dy": 0.55, "kappa1": 3e-7},
    "decentred": {"kappa1": 3e-7, "p1": 2e-5, "kappa2": 1e-13},
    "equidistant": {"projection": "equidistant", "f": 300.0},
}


def test_an_example_by_hand():
    # a ball of radius 2.5 at (40, 0, 120): its cone cuts the picture from f tan(theta - alpha) to f tan(theta + alpha)
    theta, alpha = np.arctan(40 / 120), np.arcsin(2.5 / np.hypot(40, 120))
    ends = 900 * np.tan([theta - alpha, theta + alpha])
    offset = ends.mean() - 300.0
    assert offset == pytest.approx(300 * 2.5**2 / (120**2 - 2.5**2), rel=1e-9)
    half = (ends[1] - ends[0]) / 2
    across = 900 * 2.5 / np.sqrt(120**2 - 2.5**2)
    R = np.sqrt(half * across)
    assert offset == pytest.approx(300 * (R / 900) ** 2 * np.cos(theta), rel=1e-3)
    np.testing.assert_allclose(outline_offset(PINHOLE, [620.0, 240.0], R), [offset, 0.0], rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("lens", ["none", *LENSES])
def test_the_offset_is_that_of_the_cone_seen_through_the_lens(lens):
    camera, rng = PINHOLE.with_(**LENSES.get(lens, {})), np.random.default_rng(1)
    px = rng.uniform([30, 30], [610, 450], (60, 2))
    way = line_of_sight(camera, px)[1]
    c = way / np.linalg.norm(way, axis=-1, keepdims=True) * rng.uniform(40, 100, (60, 1))
    for px_wide in (5.0, 20.0):
        r = px_wide / camera.f * np.linalg.norm(c, axis=-1) * rng.uniform(0.8, 1.2, 60)
        middle, area = middle_and_area(project(camera, touched(c, r)))
        true = middle - project(camera, c)
        found = outline_offset(camera, middle, np.sqrt(area / np.pi))
        assert np.abs(found - true).max() < max(0.005 * np.abs(true).max(), 4e-6 * px_wide**2)
        assert np.abs(true).max() > 2e-5 * px_wide**2


def test_a_lens_moves_the_middle_as_much_as_the_perspective():
    # Ru = Rd (1 + kappa1 Rd^2): -3 kappa1 R^2 x beside x (R / f)^2 cos theta, at a tenth of distortion and less
    lens = PINHOLE.with_(kappa1=3e-7)
    by_lens = outline_offset(lens, [420.0, 240.0], 10.0) - outline_offset(PINHOLE, [420.0, 240.0], 10.0)
    assert by_lens[0] == pytest.approx(-3 * 3e-7 * 10.0**2 * 100, rel=0.05)


def test_through_water_the_middle_is_that_of_the_rays_that_touch_the_ball():
    # each ray of the picture is traced on its own; the outline is where it passes the ball's middle at its radius
    rng = np.random.default_rng(2)
    b = np.array([LEFT.Cx, LEFT.Cy]) + rng.uniform(-150, 150, (12, 2))
    start, way = (np.asarray(v) for v in line_of_sight(LEFT, b))
    far = rng.uniform(60, 90, 12)
    p = start + far[:, None] * way / np.linalg.norm(way, axis=-1, keepdims=True)
    R = 15.0
    turn = 2 * np.pi * np.arange(90) / 90
    for k in range(len(b)):
        low, high = np.full(90, R / 3), np.full(90, 3 * R)
        radius = _apart(LEFT, b[k] + [R, 0.0], p[k])
        for _ in range(50):
            middle = (low + high) / 2
            ring = b[k] + middle[:, None] * np.stack([np.cos(turn), np.sin(turn)], -1)
            inside = _apart(LEFT, ring, p[k]) < radius
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        outline, area = middle_and_area(b[k] + low[:, None] * np.stack([np.cos(turn), np.sin(turn)], -1))
        found = outline_offset(LEFT, outline, np.sqrt(area / np.pi), far[k])
        np.testing.assert_allclose(found, outline - b[k], atol=2e-3)
    in_air = outline_offset(LEFT.with_(through=()), b, R)
    np.testing.assert_array_equal(outline_offset(LEFT, b, R), in_air)  # where the distance is not known


def _apart(camera, ring, p):
    q, d = line_of_sight(camera, ring)
    return np.linalg.norm(np.cross(p - q, d / np.linalg.norm(d, axis=-1, keepdims=True)), axis=-1)


def test_it_grows_with_the_square_of_the_radius_and_is_nothing_for_what_is_no_ball():
    b = np.array([[500.0, 100.0], [np.nan, 100.0], [500.0, 100.0], [500.0, 100.0], [500.0, 100.0]])
    small, _, none, unknown, large = outline_offset(PINHOLE, b, [2.0, 2.0, 0.0, np.nan, 8.0])
    np.testing.assert_allclose(large, 16 * small, rtol=1e-3)
    assert not np.any([none, unknown])
    assert not outline_offset(PINHOLE, b, 5.0)[1].any()
    assert outline_offset(PINHOLE, np.zeros((0, 2)), np.zeros(0)).shape == (0, 2)
    assert outline_offset(PINHOLE, b[:1], np.ones((3, 1))).shape == (3, 1, 2)


def test_a_ball_beyond_the_fold_of_its_lens_is_left_where_it_is():
    folding = PINHOLE.with_(kappa1=-1 / (3 * 300.0**2))  # no light lands beyond 300 px
    assert not outline_offset(folding, [615.0, 240.0], 10.0).any()
    assert outline_offset(folding, [580.0, 240.0], 10.0)[0] > 0
