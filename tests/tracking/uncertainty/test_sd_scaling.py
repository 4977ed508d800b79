"""What is added to the sd of centroids after tracking, held on rows that are known."""

import numpy as np
import pytest

from vidtrack.tracking.state import MASS, MEASURED, PIXELS, SATURATED, SD_X, SD_Y, Rows, X, Y
from vidtrack.tracking.uncertainty.sd_scaling import GROWTH, grow_sd

SD, PIXEL_COUNT, LIGHT = 0.01, 50.0, 9000.0


def rows(k=200, n=3):
    """Targets that go round in circles with white errors of SD px, all of them measured and of steady light."""
    rng = np.random.default_rng(3)
    values = np.zeros((MEASURED, k, n))
    t = 2 * np.pi * (np.arange(k)[:, None] / 60 + np.arange(n) / n)
    values[X], values[Y] = 100 + 20 * np.cos(t), 100 + 20 * np.sin(t)
    values[[X, Y]] += SD * rng.normal(size=(2, k, n))
    values[[SD_X, SD_Y]], values[PIXELS] = SD, PIXEL_COUNT
    values[MASS] = LIGHT * (1 + 0.003 * rng.normal(size=(k, n)))
    return Rows(values, np.zeros((k, n, 2)), np.zeros((k, n), np.int64), np.zeros(k))


def grown(of, lines=1, kind="weighted"):
    before = of.values.copy()
    grow_sd(of, np.arange(len(of.flag), dtype=float), lines=lines, kind=kind)
    np.testing.assert_array_equal(np.delete(of.values, (SD_X, SD_Y), axis=0), np.delete(before, (SD_X, SD_Y), axis=0))
    return of.values[[SD_X, SD_Y]]


def test_where_nothing_is_odd_the_sd_stays():
    assert grown(rows()) == pytest.approx(np.full((2, 200, 3), SD), rel=0.2)


@pytest.mark.parametrize("kind", ["weighted", "ellipse", "binary"])
def test_saturated_targets_alone_are_less_sure_down_the_rows_of_a_field_twice_as_much(kind):
    of = rows()
    of.flag[50:60, 1] = SATURATED
    sd = grown(of, lines=2, kind=kind)
    rim = dict(GROWTH.clipped)[kind] * PIXEL_COUNT**-0.25
    grid = GROWTH.grid * (2 * PIXEL_COUNT / GROWTH.grid_pixels) ** -GROWTH.grid_power if kind == "weighted" else 0.0
    more = np.hypot(1, np.array([1, 2]) * rim / SD) / np.hypot(1, np.array([1, 2]) * grid / SD)
    assert sd[:, 50:60, 1] / sd[:, 40:50, 1] == pytest.approx(more[:, None] * np.ones((2, 10)), rel=0.01)
    assert sd[:, 50:60, 0] == pytest.approx(sd[:, 40:50, 0])


def test_the_grid_of_pixels_limits_the_weighted_mean_of_tiny_targets_alone():
    of = rows()
    of.values[PIXELS, :, 1] = 7.0  # a disc of 1.5 px
    of.values[[SD_X, SD_Y]] = 1e-3
    of.values[[X, Y]] = 100 + np.arange(200)[:, None] / 3 + np.zeros(3)
    sd = grown(of)
    assert sd[0, :, 1] == pytest.approx(np.full(200, np.hypot(1e-3, 0.0055 * (12.6 / 7) ** 0.65)), rel=1e-6)
    assert sd[:, :, 0].max() < 0.003


def test_a_shadow_widens_the_sd_while_its_edge_goes_over_the_target():
    of = rows()
    of.values[MASS, 100:, 2] *= 0.6
    sd = grown(of)
    assert (sd[:, 98:102, 2] > 0.25 * 0.35 * np.sqrt(PIXEL_COUNT / np.pi)).all()
    assert sd[:, 104:, 2] == pytest.approx(np.full((2, 96), SD), rel=0.3)
    assert sd[:, :, :2] == pytest.approx(np.full((2, 200, 2), SD), rel=0.3)


def test_light_that_changes_slowly_or_targets_that_are_missing_widen_nothing():
    of = rows()
    of.values[MASS] *= np.linspace(1, 0.3, 200)[:, None]
    of.values[:, 80:90, 0] = np.nan
    sd = grown(of)
    assert np.isnan(sd[:, 80:90, 0]).all()
    assert np.nanmax(sd) < 1.5 * SD


def test_no_samples_and_no_targets_are_fine():
    assert grown(rows(0, 2)).shape == (2, 0, 2)
    assert grown(rows(10, 0)).shape == (2, 10, 0)
