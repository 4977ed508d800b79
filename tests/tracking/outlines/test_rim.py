"""The rim of a target: even where opposite sides are alike, and round where a part of a disc is cut away."""

import cv2
import numpy as np
import pytest

from tests.discs import picture as discs
from vidtrack.tracking.outlines.rim import RIM, look_at_rims, middle_of_arc, middle_of_rim

SHAPE, LEVEL, LIGHT, RADIUS = (60, 80), 40.0, 100.0, 6.0
ANGLE = 2 * np.pi * np.arange(RIM.rays) / RIM.rays


def ball(x=40.3, y=30.6, noise=0.0, water=None, ratio=1.0, **more):
    luma = discs(SHAPE, [(x, y, RADIUS, LIGHT)], level=LEVEL, noise=noise, rng=np.random.default_rng(1), ratio=ratio)
    if water is not None:
        luma[water:] = LEVEL
    return cv2.GaussianBlur(luma, (0, 0), 0.7)


def looked(luma, x=40.3, y=30.6, noise=1.0, **more):
    return look_at_rims(luma, np.array([[x, y]]), np.array([np.pi * RADIUS**2]), noise, **more)


def of_circle(x, y, radius, cut=np.inf):
    """The rim, seen from 0, 0, of a disc at x, y whose part below the line y = cut is gone."""
    along = x * np.cos(ANGLE) + y * np.sin(ANGLE)
    rim = along + np.sqrt(radius**2 - (x * x + y * y - along**2))
    down = np.sin(ANGLE)
    return np.where(rim * down > cut, cut / np.where(down > 0, down, 1.0), rim)[None]


@pytest.mark.parametrize("ratio", [1.0, 1.3])
def test_the_rim_of_a_disc_and_of_an_ellipse_is_even(ratio):
    seen = looked(ball(ratio=ratio))
    assert seen.uneven[0] < 0.04


def test_the_rim_of_a_disc_lies_at_its_radius():
    np.testing.assert_allclose(looked(ball()).rim[0], RADIUS, atol=0.15)


def test_a_disc_that_water_cuts_is_uneven_and_its_round_part_has_the_middle_of_the_whole():
    luma = ball(water=32)
    light = luma.astype(float) - LEVEL
    row, column = np.indices(SHAPE)
    x, y = (light * column).sum() / light.sum(), (light * row).sum() / light.sum()
    assert y < 30.6 - 1.0
    seen = looked(luma, x, y)
    assert seen.uneven[0] > 0.15
    way, good = middle_of_arc(seen.rim, seen.sd)
    assert good[0]
    np.testing.assert_allclose([x + way[0, 0], y + way[1, 0]], [40.3, 30.6], atol=0.15)


@pytest.mark.parametrize("cut", [2.0, 3.5])
def test_the_middle_of_an_arc_is_the_circles_by_hand(cut):
    way, good = middle_of_arc(of_circle(0.2, 1.1, 6.0, cut), np.array([0.01]))
    np.testing.assert_allclose(way[:, 0], [0.2, 1.1], atol=1e-9)
    assert good[0]


def test_what_is_no_part_of_a_circle_is_said_to_be_none():
    square = 5 / np.maximum(np.abs(np.cos(ANGLE)), np.abs(np.sin(ANGLE)))
    assert not middle_of_arc(square[None], np.array([0.01]))[1][0]


def test_noise_makes_a_rim_as_uneven_as_its_sd_says():
    rng, over = np.random.default_rng(3), []
    for _ in range(40):
        x, y = 40 + rng.uniform(-0.5, 0.5, 2)
        luma = cv2.GaussianBlur(discs(SHAPE, [(x, y - 10, RADIUS, LIGHT)], level=LEVEL, dtype=float), (0, 0), 0.7)
        luma = luma + rng.normal(0, 2.0, SHAPE)
        seen = looked(luma, x, y - 10, 2.0)
        over.append(seen.uneven[0] / seen.sd[0])
    assert 0.2 < np.median(over) < 0.8
    assert max(over) < 1.3


def test_fields_are_seen_as_frames_are():
    x, y = 40.3, 30.6
    whole = looked(ball())
    field = look_at_rims(ball()[::2], np.array([[x, y / 2]]), np.array([np.pi * RADIUS**2 / 2]), 1.0, lines=2)
    np.testing.assert_allclose(field.rim, whole.rim, atol=0.3)
    assert field.uneven[0] < 0.12


@pytest.mark.parametrize(
    ("x", "y", "pixels"), [(5.0, 30.0, 113.0), (40.0, 57.0, 113.0), (40.3, 30.6, 12.0), (np.nan, 30.0, 113.0)]
)
def test_what_is_small_or_at_the_edge_or_was_not_measured_is_not_looked_at(x, y, pixels):
    seen = look_at_rims(ball(), np.array([[x, y]]), np.array([pixels]), 1.0)
    assert all(np.isnan(values).all() for values in seen)


def test_levels_of_other_depths_give_the_same_rim():
    deep = look_at_rims(ball().astype(np.uint16) * 256, np.array([[40.3, 30.6]]), np.array([113.0]), 1.0, scale=1 / 256)
    np.testing.assert_allclose(deep.rim, looked(ball()).rim, atol=1e-3)


def test_the_first_harmonic_of_a_rim_is_the_way_to_its_middle():
    angle = 2 * np.pi * np.arange(RIM.rays) / RIM.rays
    away, to = np.array([0.3, 0.05]), np.array([1.0, 4.0])
    along = away[:, None] * np.cos(angle - to[:, None])
    rim = along + np.sqrt(8.0**2 - away[:, None] ** 2 + along**2)  # a circle of 8 px about (away, to)
    way, sd = middle_of_rim(rim, np.array([0.1, 0.2]))
    assert np.abs(way - away * np.stack([np.cos(to), np.sin(to)])).max() < 1e-3
    assert np.allclose(sd, [0.025, 0.05])


def shaded(share):
    """A ball and its background, of which the right half is darker by this share, softly; and its middle of light."""
    row, column = np.indices(SHAPE)
    luma = ball().astype(float) * (1 - share / (1 + np.exp((40.3 - column) / 1.5)))
    weight = np.where(np.hypot(column - 40.3, row - 30.6) < RADIUS + 3, luma - luma[0, column], 0.0)
    return luma, (weight * column).sum() / weight.sum()


def test_the_edge_of_a_ball_in_half_a_shadow_shows_where_it_is_and_the_rim_at_one_level_does_not():
    luma, x = shaded(0.4)
    assert x < 40.3 - 0.4
    seen = looked(luma, x)
    edge, rim = (x + middle_of_rim(some, seen.sd)[0][0, 0] for some in (seen.edge, seen.rim))
    assert edge - x > 0.4 * (40.3 - x)
    assert abs(edge - 40.3) < abs(rim - 40.3)


def test_the_edge_of_a_plain_disc_is_its_rim_and_that_of_a_side_that_hardly_stands_out_is_not_known():
    seen = looked(ball())
    np.testing.assert_allclose(seen.edge, seen.rim, atol=0.1)
    luma = ball().astype(float)
    luma[:, 41:] = LEVEL + 0.2 * (luma[:, 41:] - LEVEL)
    assert np.isnan(looked(luma, 39.0).edge).all()


def test_a_shadow_lies_on_the_background_too_and_a_bright_point_on_a_ball_does_not():
    assert looked(shaded(0.4)[0]).sided[0] == 1
    glossy = discs(SHAPE, [(40.3, 30.6, RADIUS, LIGHT), (43.0, 30.6, 1.8, LIGHT)], level=LEVEL)
    assert looked(cv2.GaussianBlur(glossy, (0, 0), 0.7)).sided[0] == 0
    assert looked(ball(noise=1.5)).sided[0] == 0
