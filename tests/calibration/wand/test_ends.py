"""Which ball is which end: by the line through three, else one question a stretch."""

import numpy as np
import pytest

from tests.calibration.wand.waved import waved
from vidtrack.calibration.wand.ends import chosen, collinear, complete, jointly, ordered, orders, stretches, unequal
from vidtrack.calibration.wand.measured import wand_of


def test_two_balls_can_be_either_and_three_unequal_ones_name_themselves():
    assert len(orders(wand_of({"A-B": 20}, 0.01).lengths)) == 2
    straight = wand_of({"A-B": 10, "B-C": 20}, 0.01)
    assert straight.lengths[0, 2] == 30
    assert collinear(straight.lengths)
    assert unequal(straight.lengths)
    assert orders(straight.lengths) == [(0, 1, 2)]
    assert len(orders(wand_of({"A-B": 10, "B-C": 10}, 0.01).lengths)) == 2
    assert len(orders(wand_of({"A-B": 3, "B-C": 4, "A-C": 5}, 0.01).lengths)) == 6


@pytest.mark.parametrize("seed", range(3))
def test_balls_of_a_straight_wand_are_put_in_the_order_of_its_ends_whatever_the_tracker_calls_them(seed):
    scene = waved(seed, lengths={"A-B": 8, "B-C": 16}, noise=0.0)
    for b in scene.b:
        mixed = np.take_along_axis(b, scene.rng.permuted(np.tile(np.arange(3), (len(b), 1)), axis=1)[..., None], 1)
        whole = complete(b)
        apart = np.linalg.norm(b[:, 0] - b[:, 2], axis=-1) > 3  # not seen along its own line
        np.testing.assert_array_equal(ordered(mixed, scene.wand.lengths)[whole & apart], b[whole & apart])


def test_a_moment_with_a_ball_missing_is_left_out():
    scene = waved(0, lengths={"A-B": 8, "B-C": 16})
    b = scene.b[0].copy()
    b[5, 1] = np.nan
    assert np.isnan(ordered(b, scene.wand.lengths)[5]).all()


def test_a_stretch_ends_where_balls_come_close_or_are_lost():
    b = np.zeros((40, 2, 2))
    b[:, 0, 0] = 100
    b[20, 0, 0] = 2  # they touch for a moment
    b[30:36] = np.nan
    found = stretches(b)
    assert found[19] != found[21]
    assert found[29] != found[36]
    assert len(np.unique(found[:20])) == 1
    assert (np.diff(jointly([found, np.zeros(40, int)])) == np.diff(found)).all()


def test_each_stretch_takes_the_order_that_costs_less_in_sum():
    cost = np.array([[1.0, 9, 1, 5, 5], [2.0, 2, 2, 1, np.nan]])
    best, each = chosen(cost, np.array([0, 0, 0, 1, 1]), 4.0)
    assert best.tolist() == [0, 0, 0, 1, 1] or best.tolist() == [1, 1, 1, 1, 1]
    best, each = chosen(cost, np.array([0, 0, 0, 1, 1]), 100.0)
    assert best.tolist() == [1, 1, 1, 1, 1]
    assert each[0] == 2.0
