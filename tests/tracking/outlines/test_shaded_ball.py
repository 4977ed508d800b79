"""The middle of the outline of a ball that is lit from one side."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from tests.lit_balls import picture
from vidtrack.tracking.outlines import shaded_ball
from vidtrack.tracking.outlines.ball_outline import LIT
from vidtrack.tracking.outlines.shaded_ball import fit_ball, is_cut


@pytest.fixture
def rng():
    return np.random.default_rng(11)


SHAPE, PLACE = (41, 45), (21.3, 19.6)


def centroid(light, ground=30.0):
    over = np.where(light > ground + 12, light - ground, 0)
    row, column = np.mgrid[: light.shape[0], : light.shape[1]]
    return np.array([(over * column).sum(), (over * row).sum()]) / over.sum()


def fitted(rng, noise=0.5, radius=6.0, **how):
    """The error of the light's middle, that of the outline's, and the fit."""
    light = picture(SHAPE, [(*PLACE, radius)], **how) + rng.normal(0, noise, SHAPE)
    at = centroid(light)
    fit = fit_ball(light, at, 0.9 * radius, noise)
    assert fit is not None
    return at - PLACE, at + fit.way - PLACE, fit


@pytest.mark.parametrize("radius", [3.0, 5.0, 9.0])
@pytest.mark.parametrize("ambient", [0.2, 0.6])
@pytest.mark.parametrize("lamp", [(1, 0, 1.5), (0.3, -1, 0.4), (-1, 0.5, -0.2)])
def test_the_middle_of_the_outline_is_where_the_ball_is(lamp, ambient, radius, rng):
    light, outline, fit = fitted(rng, lamp=lamp, ambient=ambient, radius=radius)
    assert np.hypot(*light) > 0.02 * radius
    assert np.hypot(*outline) < min(0.25 * np.hypot(*light), 4 * fit.sd)
    assert fit.radius == pytest.approx(radius, rel=0.06)


@pytest.mark.parametrize("ambient", [0.02, 0.05])
@pytest.mark.parametrize("level", [420.0, 500.0])
def test_a_lit_side_that_is_saturated_is_at_least_as_bright(level, ambient, rng):
    light = picture(SHAPE, [(*PLACE, 6.0)], lamp=(1, 0.2, 0.3), ambient=ambient, level=level)
    light = np.clip(light + rng.normal(0, 1.5, SHAPE), 0, 255)
    at = centroid(light)
    fit, flat = (fit_ball(light, at, 5.4, 1.5, full=full) for full in (light >= 254, None))
    assert fit is not None
    assert np.hypot(*(at + fit.way - PLACE)) < min(0.08, 4 * fit.sd)
    assert flat is not None
    assert np.hypot(*(at + flat.way - PLACE)) > 0.2, "what is clipped looks flat"


def test_the_width_holds_where_the_lamp_stands_behind_the_camera(monkeypatch):
    def errors():
        found = []
        for seed in range(8):
            rng = np.random.default_rng(seed)
            light = picture(SHAPE, [(*PLACE, 4.7)], lamp=(0.35, 0.1, 1), ambient=0.28, level=150, blur=1.0)
            light = light + rng.normal(0, 1.1, SHAPE)
            at, own = centroid(light), np.sqrt((light > 60).sum() / np.pi)
            fit = fit_ball(light, at, own, 1.1, height=0.0)
            found.append((fit.radius / 4.7 - 1, np.hypot(*(at + fit.way - PLACE))))
        return np.mean(found, axis=0)

    larger, off = errors()
    assert abs(larger) < 0.015
    monkeypatch.setattr(shaded_ball, "BALL_FIT", replace(shaded_ball.BALL_FIT, matt=1.0))
    smaller, further = errors()
    assert smaller < -0.02, "a polynomial falls off less towards the rim than a matt ball does"
    assert off < 0.7 * further


def test_a_ball_that_is_lit_from_everywhere_has_one_middle(rng):
    light, outline, fit = fitted(rng, lamp=None)
    assert np.hypot(*light) < 0.02
    assert np.hypot(*outline) < 0.02
    assert fit.sd < 0.05


def test_two_lamps_are_no_lambert_ball_and_the_sd_holds_it(rng):
    one, other = ({"lamp": lamp, "ambient": 0.2} for lamp in ((1, 0.2, 0.6), (-0.7, -1, 0.5)))
    light = sum(picture(SHAPE, [(*PLACE, 6.0)], level=100, ground=15, **how) for how in (one, other))
    at = centroid(light)
    fit = fit_ball(light + rng.normal(0, 0.5, SHAPE), at, 5.5, 0.5)
    assert fit is not None
    assert np.hypot(*(at + fit.way - PLACE)) < min(0.7 * np.hypot(*(at - PLACE)), 4 * fit.sd)


def test_pixels_that_are_not_square_make_an_ellipse(rng):
    light, outline, _ = fitted(rng, lamp=(1, 1, 0.6), rows=1.25)
    assert np.hypot(*light) > 0.4
    assert np.hypot(*outline) < 0.1


def test_the_rows_of_a_field_lie_two_px_apart(rng):
    light = picture((60, 45), [(21.3, 30.4, 6.0)], lamp=(1, 0.6, 0.6))
    field = light.reshape(30, 2, 45).mean(axis=1) + rng.normal(0, 0.5, (30, 45))
    at = centroid(field)
    fit = fit_ball(field, at, 5.5, 0.5, lines=2)
    assert fit is not None
    truth = np.array([21.3, 30.4])
    shown = np.array([at[0], 2 * at[1] + 0.5])
    assert np.hypot(*(shown - truth)) > 0.4
    assert np.hypot(*(shown + fit.way - truth)) < 0.12


def test_what_is_no_ball_leaves_much(rng):
    light = picture(SHAPE, [(*PLACE, 6.0)], lamp=None)
    light[:, 20:23] = 30  # a rope before it
    fit = fit_ball(light + rng.normal(0, 0.5, SHAPE), PLACE, 5.5, 0.5)
    assert fit is None or fit.misfit > 0.08


def cut(rng, deep, radius, angle, *, water=40.0, noise=1.0):
    """Whether a ball that water covers from `deep` radii on, in a direction, counts as cut."""
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    below = (column - PLACE[0]) * np.cos(angle) + (row - PLACE[1]) * np.sin(angle) - deep * radius
    light = picture(SHAPE, [(*PLACE, radius)], lamp=None)
    light = light + ndtr(below / 0.6) * (water - light) + rng.normal(0, noise, SHAPE)
    over = np.where(light > 120, light - 30, 0)
    at = np.array([(over * column).sum(), (over * row).sum()]) / over.sum()
    own = np.sqrt((over > 0).sum() / np.pi)
    return is_cut(light, at, own, noise, fit_ball(light, at, own, noise))


@pytest.mark.parametrize("radius", [4.0, 6.0, 8.0])
@pytest.mark.parametrize("deep", [-0.1, 0.2, 0.5])
@pytest.mark.parametrize("angle", [np.pi / 2, 0.3])
def test_a_ball_that_a_line_cuts_is_not_lit_from_one_side(deep, radius, angle, rng):
    assert cut(rng, deep, radius, angle)


@pytest.mark.parametrize("radius", [3.0, 5.0, 8.0])
@pytest.mark.parametrize("ambient", [0.1, 0.4])
@pytest.mark.parametrize("lamp", [(1, 0, 1.5), (0.3, -1, 0.4), (-1, 0.5, -0.2)])
def test_a_ball_in_a_lamps_light_is_not_cut(lamp, ambient, radius, rng):
    light = picture(SHAPE, [(*PLACE, radius)], lamp=lamp, ambient=ambient) + rng.normal(0, 1, SHAPE)
    at = centroid(light)
    fit = fit_ball(light, at, radius, 1.0)
    assert not is_cut(light, at, radius, 1.0, fit, held=fit.misfit < LIT.misfit)
    worse = fit._replace(misfit=max(fit.misfit, 0.02))
    assert not is_cut(light, at, radius, 1.0, worse, held=fit.misfit < LIT.misfit), "the line fits worse than the lamp"
