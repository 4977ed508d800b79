"""Overlapping discs fitted together: where they are, how sure, and when they are not separated."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from vidtrack.tracking.discs.joint_fit import fit_together, shapes_again, shapes_of, stations_of

FINE, NOISE = 6, 3.0


def drawn(rng, radius, light, overlap, *, blur=0.7, noise=NOISE):
    """Two opaque discs, the second in front, before black; their middles (2, 2) px. overlap: of the lesser diameter."""
    side = int(4 * max(radius) + 18)
    apart = sum(radius) - 2 * overlap * min(radius)
    angle, middle = rng.uniform(0, 2 * np.pi), side / 2 + rng.uniform(-0.5, 0.5, 2)
    half = apart / 2 * np.array([np.cos(angle), np.sin(angle)])
    at = np.array([middle - half, middle + half])
    place = (np.arange(side * FINE) + 0.5) / FINE - 0.5
    image = np.zeros((side * FINE, side * FINE))
    for (x, y), r, a in zip(at, radius, light, strict=True):
        share = np.clip((r - np.hypot(place - x, place[:, None] - y)) * FINE + 0.5, 0, 1)
        image += share * (a - image)
    pixels = gaussian_filter(image, blur * FINE).reshape(side, FINE, side, FINE).mean(axis=(1, 3))
    return (pixels + rng.normal(0, noise, pixels.shape)).astype(np.float32), at


def fitted(data, at, radius, light, rng, *, free=None, again=False, off=0.4):
    r, a = np.array(radius), np.array(light)
    if again:
        known = shapes_again(np.log(np.array([r, r, a, 0.7 + 0 * r])))
    else:
        r = r * rng.normal(1, 0.05, len(r))
        known = shapes_of(np.pi * r**2, np.stack([2 * r, 2 * r]), a * rng.normal(1, 0.08, len(r)))
    x, y = (at + rng.normal(0, off, at.shape)).T
    whole = np.ones(data.shape, bool) if free is None else free
    return fit_together(data, whole, data > 1e9, x, y, known, NOISE)


def errors(fit, at):
    return np.stack([fit.x, fit.y], axis=1) - at, np.stack([fit.sd_x, fit.sd_y], axis=1)


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("light", [(180.0, 180.0), (180.0, 110.0)])
@pytest.mark.parametrize("overlap", [0.0, 0.25, 0.5])
@pytest.mark.parametrize("radius", [(4.0, 4.0), (7.0, 5.0)])
def test_two_discs_that_overlap_are_found_as_well_as_their_sigma_says(radius, overlap, light, again):
    rng = np.random.default_rng(1)
    z, found = [], 0
    for _ in range(20):
        data, at = drawn(rng, radius, light, overlap)
        fit = fitted(data, at, radius, light, rng, again=again)
        found += fit.good
        error, sd = errors(fit, at)
        z.append(error / sd)
        assert not fit.good or np.abs(error).max() < 0.2
    assert found >= 18
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_discs_that_cover_each_other_almost_wholly_are_not_separated():
    rng = np.random.default_rng(2)
    good = []
    for _ in range(10):
        data, at = drawn(rng, (4.0, 4.0), (180.0, 180.0), 0.85)
        good.append(fitted(data, at, (4.0, 4.0), (180.0, 180.0), rng, again=True).good)
    assert not any(good)


def test_a_disc_of_which_a_third_is_hidden_is_found_by_its_rim():
    rng = np.random.default_rng(3)
    z = []
    for _ in range(20):
        data, at = drawn(rng, (6.0, 1.0), (180.0, 0.0), -3.0)
        hidden = np.zeros(data.shape, bool)
        column = int(at[0, 0])
        hidden[:, column - 1 : column + 4] = True
        data[hidden] = 90.0
        fit = fitted(data, at[:1], (6.0,), (180.0,), rng, free=~hidden, again=True)
        assert fit.good
        error, sd = errors(fit, at[:1])
        z.append(error / sd)
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.4


@pytest.mark.parametrize(("again", "left"), [(False, 3), (True, 3), (True, 4)])
def test_a_single_disc_of_which_a_tenth_to_a_fifth_is_seen_is_measured_as_well_as_its_sigma_says(again, left):
    rng = np.random.default_rng(5)
    z = []
    for _ in range(20):
        data, at = drawn(rng, (6.0, 1.0), (180.0, 0.0), -3.0)
        hidden = np.zeros(data.shape, bool)
        column = int(at[0, 0])
        hidden[:, column - left : column + 5] = True
        data[hidden] = 90.0
        fit = fitted(data, at[:1], (6.0,), (180.0,), rng, free=~hidden, again=again)
        assert fit.good
        error, sd = errors(fit, at[:1])
        z.append(error / sd)
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.4
    hidden[:] = True
    assert not fitted(data, at[:1], (6.0,), (180.0,), rng, free=~hidden, again=again).good


def test_of_two_discs_that_only_touch_a_fifth_of_one_is_enough():
    """Of two that overlap it is not: which of them a part belongs to is less certain."""
    rng = np.random.default_rng(7)
    z, size = [], ((6.0, 6.0), (180.0, 180.0))
    for overlap in [0.0] * 20 + [0.3] * 4:
        data, at = drawn(rng, *size, overlap)
        y, x = np.mgrid[: data.shape[0], : data.shape[1]]
        way = at[1] - at[0]
        # a rope along the line of both, over one of them
        off = ((x - at[1, 0]) * way[0] + (y - at[1, 1]) * way[1]) / np.hypot(*way)
        hidden = (np.abs((x - at[1, 0]) * way[1] - (y - at[1, 1]) * way[0]) / np.hypot(*way) < 3.9) & (off > -6.5)
        data[hidden] = 90.0
        fit = fitted(data, at, *size, rng, free=~hidden, again=True)
        assert fit.good == (not overlap)
        error, sd = errors(fit, at)
        z.append(error / sd)
    assert 0.4 < np.sqrt(np.mean(np.square(z[:20]))) < 1.4


def test_a_disc_that_is_just_where_it_was_expected_has_its_shape_fitted_too():
    """Its first step moves nothing but the shape."""
    y, x = np.mgrid[:40, :40]
    data = (180 * ndtr((8.0 - np.hypot(x - 20, y - 20)) / 0.7)).astype(np.float32)
    shape = shapes_of(np.array([np.pi * 7.5**2]), np.full((2, 1), 15.0), np.array([190.0]))
    free, at = np.ones(data.shape, bool), np.full(1, 20.0)
    fit = fit_together(data, free, ~free, at, at, shape, NOISE)
    assert fit.left < 2 * NOISE
    assert np.abs(np.exp(fit.shape[:2]) - 8).max() < 0.1


def test_something_that_is_no_disc_of_that_size_is_no_measurement():
    rng = np.random.default_rng(4)
    data, at = drawn(rng, (9.0, 9.0), (180.0, 180.0), 0.3)
    assert not fitted(data, at, (4.0, 4.0), (180.0, 180.0), rng, again=True).good
    assert not fitted(data * 0, at, (9.0, 9.0), (180.0, 180.0), rng, again=True).good


def test_a_disc_that_something_dims_in_part_is_found_within_its_sd():
    rng = np.random.default_rng(6)
    for k in range(12):
        data, at = drawn(rng, (12.0, 1.0), (180.0, 0.0), -3.0)
        y, x = np.mgrid[: data.shape[0], : data.shape[1]]
        angle = 2 * np.pi * k / 12
        side = (x - at[0, 0]) * np.cos(angle) + (y - at[0, 1]) * np.sin(angle)
        shaded = (data * np.where(side > 7, 0.85, 1.0)).astype(np.float32)
        error, sd = errors(fitted(shaded, at[:1], (12.0,), (180.0,), rng), at[:1])
        assert (np.abs(error) < 5 * sd).all()
        assert np.abs(error).max() > 5 * errors(fitted(data, at[:1], (12.0,), (180.0,), rng), at[:1])[1].max()


def test_rounding_of_where_a_fit_begins_moves_its_end_by_no_more_than_itself():
    """Processors round sums otherwise: an end that grows what they differ by would differ from one to the next."""
    rng = np.random.default_rng(6)
    moved = []
    for _ in range(10):
        data, at = drawn(rng, (4.0, 4.0), (180.0, 180.0), 0.25)
        known = shapes_of(np.full(2, 50.0), np.full((2, 2), 8.0), np.full(2, 180.0))
        whole, (x, y) = np.ones(data.shape, bool), at.T
        one, two = (fit_together(data, whole, ~whole, x + 0.2 + part, y - 0.2, known, NOISE) for part in (0.0, 1e-9))
        moved += [np.abs(one.x - two.x).max(), np.abs(one.y - two.y).max()]
    assert max(moved) < 1e-9


def test_the_stations_of_an_exposure_lie_on_a_parabola_about_their_mean():
    drawn = np.array([[[6.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.2, 0.0]]])  # the first disc goes 6 px across, bent down
    off = stations_of(drawn)
    assert off.shape == (3, 2, 2)
    assert off[:, 0, 0] == pytest.approx([-2.0, 0.0, 2.0])
    assert off[:, 1, 0] == pytest.approx([1.2 * (1 / 9 - 1 / 12), -0.1, 1.2 * (1 / 9 - 1 / 12)])
    assert not off[..., 1].any()
    assert len(stations_of(np.zeros((2, 2, 1)))) == 1


def test_discs_of_other_lights_that_move_during_the_exposure_are_separated_within_their_sd():
    z = []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        way = rng.uniform(-6, 6, (2, 2))
        tau = (np.arange(20) + 0.5) / 20 - 0.5
        place = (np.arange(40 * FINE) + 0.5) / FINE - 0.5
        at = np.array([[16.0, 19.0], [24.5, 21.0]]) + rng.uniform(-0.5, 0.5, (2, 2))
        total = np.zeros((40 * FINE, 40 * FINE))
        for t in tau:
            image = np.zeros_like(total)
            for (x, y), light in zip(at + t * way, (110.0, 170.0), strict=True):
                share = np.clip((5 - np.hypot(place - x, place[:, None] - y)) * FINE + 0.5, 0, 1)
                image += share * (light - image)
            total += image / len(tau)
        data = gaussian_filter(total, 0.7 * FINE).reshape(40, FINE, 40, FINE).mean(axis=(1, 3))
        data = (data + rng.normal(0, NOISE, data.shape)).astype(np.float32)
        known = shapes_of(np.full(2, 25 * np.pi), np.full((2, 2), 10.0), np.array([110.0, 170.0]))
        drawn = np.stack([way.T, np.zeros((2, 2))])
        x, y = (at + rng.normal(0, 0.4, at.shape)).T
        fit = fit_together(data, np.ones(data.shape, bool), data > 1e9, x, y, known, NOISE, drawn=drawn)
        if fit.good:
            z.append((np.stack([fit.x, fit.y], axis=-1) - at) / np.stack([fit.sd_x, fit.sd_y], axis=-1))
    assert len(z) > 10
    assert np.sqrt(np.mean(np.square(z))) < 1.4
    assert np.abs(z).max() < 5
