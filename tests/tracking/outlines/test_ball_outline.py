"""Pieces of pictures about balls, laid over each other."""

import numpy as np
import pytest

from tests.lit_balls import noisy, picture
from vidtrack.tracking.outlines.ball_outline import LIT, by_place, laid_over, light_of, outline_of, piece_of


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def piece(x, y, radius=5.0, rng=None, sample=0, **how):
    rng = rng or np.random.default_rng(0)
    grey = noisy(picture((60, 80), [(x, y, radius)], **how), rng)
    return piece_of(grey, (x, y), np.pi * radius**2, shown=(None, sample))


def test_a_piece_shows_a_ball_and_its_background():
    own = piece(40.2, 30.7)
    assert own.where == (40.2, 30.7)
    assert own.radius == pytest.approx(5.0)
    assert own.grey.shape[0] >= 2 * (LIT.room * 5 + LIT.room_px)
    assert own.at == pytest.approx((40.2 - 40 + own.grey.shape[1] // 2, 30.7 - 31 + own.grey.shape[0] // 2))


@pytest.mark.parametrize(("x", "y", "radius"), [(5, 30, 5), (40, 57, 5), (40, 30, 1.5), (np.nan, 30, 5)])
def test_no_piece_of_what_is_small_or_at_the_edge(x, y, radius):
    grey = np.zeros((60, 80), np.uint8)
    assert piece_of(grey, (x, y), np.pi * radius**2) is None


def test_large_balls_are_reduced():
    grey = noisy(picture((140, 160), [(80.3, 70.2, 24.0)], lamp=None), np.random.default_rng(1))
    own = piece_of(grey, (80.3, 70.2), np.pi * 24**2)
    assert own.shrunk == 2
    assert own.radius == pytest.approx(12.0)
    over = own.grey - 30.0
    row, column = np.mgrid[: over.shape[0], : over.shape[1]]
    assert (over * column).sum() / over.sum() == pytest.approx(own.at[0], abs=0.05)
    assert (over * row).sum() / over.sum() == pytest.approx(own.at[1], abs=0.05)


def test_pieces_near_each_other_go_together(rng):
    pieces = [piece(x, 30.0, rng=rng, sample=k) for k, x in enumerate(np.linspace(20, 60, 16))]
    groups = by_place(pieces, 4)
    assert [len(own) for own in groups] == [4, 4, 4, 4]
    reach = [(min(one.where[0] for one in own), max(one.where[0] for one in own)) for own in groups]
    assert sorted(reach) in (reach, reach[::-1])
    assert all(before[1] < after[0] for before, after in zip(sorted(reach), sorted(reach)[1:], strict=False))
    laid = laid_over(groups[0], 1)
    assert laid.number == 4
    rows, columns = laid.grey.shape
    assert laid.grey[rows // 2, columns // 2] > 100


def test_a_ball_lit_from_one_side_is_seen_to_be(rng):
    lit, plain = (
        light_of(laid_over([piece(40.2, 30.7, rng=rng, lamp=lamp)], 1), 1.5, 1) for lamp in ((1, 0, 0.5), None)
    )
    assert lit.plainly
    assert not plain.plainly
    assert np.hypot(*lit.aside) > 5 * np.hypot(*plain.aside)
    assert lit.aside[0] < -0.1  # away from the lamp


def test_a_ball_with_something_beside_it_is_not_looked_at(rng):
    grey = noisy(picture((60, 80), [(40, 30, 5.0), (51.5, 30, 5.0)], lamp=None), rng)
    assert light_of(laid_over([piece_of(grey, (40, 30), 80)], 1), 1.5, 1) is None


def test_where_no_fit_holds_the_sd_is_as_large_as_the_way_may_be(rng):
    grey = noisy(picture((60, 80), [(40, 30, 6.0)], lamp=None), rng)
    grey[:, 42:45] = 30  # a rope before it
    own = outline_of(light_of(laid_over([piece_of(grey, (39.5, 30.0), 90)], 1), 1.5, 1), 1.5, 1)
    assert not own.held
    assert not own.way.any()
    assert own.sd > 0.05


def test_what_is_laid_over_each_other_is_of_the_moment_at_which_the_ball_was_nearest_to_there():
    """A ball that swings is at a place at many times: their median is none of them."""
    there = [(20.0, 3), (22.0, 40), (24.0, 5), (21.0, 77), (23.2, 79)]
    one = laid_over([piece(x, 30.0, sample=k) for x, k in there], 1)
    assert one.where[0] == pytest.approx(22.04)
    assert one.sample == 40


@pytest.mark.parametrize("radius", [6.0, 24.0])
def test_what_is_saturated_is_so_in_a_reduced_piece_and_in_those_laid_over_each_other(radius):
    grey = picture((140, 160), [(80.3, 70.2, radius)], lamp=(1, 0.2, 0.3), ambient=0.1, level=400.0)
    clipped = noisy(grey, np.random.default_rng(5))
    own = piece_of(clipped, (80.3, 70.2), np.pi * radius**2)
    assert own.full.shape == own.grey.shape
    laid = laid_over([own, own], 1)
    rows, columns = laid.grey.shape
    assert laid.full[rows // 2, columns // 2 + int(0.6 * own.radius)]
    assert not laid.full[:, : columns // 2 - int(0.6 * own.radius)].any()
    fit = outline_of(light_of(laid, 1.0, 1), 1.0, 1)
    assert np.hypot(*(fit.way * own.radius)) < 0.05 * own.radius, "the piece is laid about the middle itself"


def test_outlines_are_fitted_to_pixels_as_they_are_and_not_to_what_lies_between_them():
    rng, off = np.random.default_rng(7), []
    for _ in range(8):
        x, y = 40 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5)
        grey = picture((60, 80), [(x, y, 9.0)], lamp=(1, 0.3, 0.6), ambient=0.2)
        pieces = [piece_of(noisy(grey, rng, 0.5), (x, y), np.pi * 81) for _ in range(2)]
        laid = laid_over(pieces, 1)
        both = laid, laid._replace(pixels=laid.grey, at=(laid.grey.shape[1] // 2, laid.grey.shape[0] // 2))
        off.append([np.hypot(*outline_of(light_of(one, 0.5, 1), 0.5, 1).way) * 9 for one in both])
    whole, between = np.mean(off, axis=0)
    assert whole < 0.02
    assert between > 1.5 * whole
