"""Shifts of patches: exact to a few hundredths of a px whatever the light, from hundredths to tens of px."""

import numpy as np
import pytest

from tests.steadiness.scenes import F, Wall
from vidtrack.steadiness.patches import chosen_patches
from vidtrack.steadiness.registration import Reference

RNG = np.random.default_rng(5)
WALL = Wall(np.random.default_rng(5))
PICTURE = WALL.clean()
MIDDLES = chosen_patches(PICTURE)
REFERENCE = Reference(PICTURE, MIDDLES)


def noisy(picture, noise=3.0):
    return np.clip(np.rint(picture + RNG.normal(0, noise, picture.shape)), 0, 255)


@pytest.mark.parametrize("px", [0.0, 0.03, 0.4, -1.3, 6.0, -20.0])
def test_a_shift_is_found_to_a_few_hundredths(px):
    theta = np.array([0, px / F, 0.3 * px / F, 0.0])
    shifts = REFERENCE.shifts(noisy(WALL.clean(theta)))
    true = WALL.law(MIDDLES.astype(float), theta) - MIDDLES
    error = (shifts.shift - true)[shifts.found]
    assert shifts.found.mean() > 0.6
    assert np.abs(error.mean(0)).max() < 0.015 + 0.001 * abs(px)  # a turn stretches what it carries far
    assert error.std() < 0.05


def test_light_shade_and_contrast_do_not_count_as_shift():
    y, x = np.mgrid[0:240, 0:320]
    shifts = REFERENCE.shifts(noisy(0.5 * PICTURE + 60 + 0.2 * x - 0.1 * y))
    assert shifts.found.all()
    assert np.abs(shifts.shift.mean(0)).max() < 0.015


def test_what_is_covered_is_not_found():
    picture = PICTURE.copy()
    picture[:, :160] = Wall(np.random.default_rng(99)).clean()[:, :160]
    shifts = REFERENCE.shifts(noisy(picture))
    well = np.abs(shifts.shift).max(1) < 0.2
    assert well[MIDDLES[:, 0] > 180].all()
    assert well[MIDDLES[:, 0] < 140].mean() < 0.1


def test_a_start_far_off_does_no_harm():
    start = np.full((len(MIDDLES), 2), 9.0)
    shifts = REFERENCE.shifts(noisy(PICTURE), start)
    assert shifts.found.all()
    assert np.abs(shifts.shift).max() < 0.2


def test_the_standard_deviations_order_patches_as_their_errors_do():
    weak = Wall(np.random.default_rng(8), contrast=4)
    strong = Wall(np.random.default_rng(8), contrast=24)
    sds = []
    for wall in (weak, strong):
        picture = wall.clean()
        shifts = Reference(picture, chosen_patches(picture)).shifts(noisy(picture))
        sds.append(np.nanmean(shifts.sd))
    assert sds[0] / sds[1] == pytest.approx(6, rel=0.3)


def test_no_patches_give_no_shifts():
    shifts = Reference(PICTURE, np.empty((0, 2), np.intp)).shifts(PICTURE)
    assert shifts.shift.shape == (0, 2)
    assert not shifts.found.any()
