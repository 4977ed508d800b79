"""Of the causes why lines of sight miss, the one that is at work is found, with its amount."""

import numpy as np
import pytest

from tests.location.test_sight_misses import AT, misses
from vidtrack.location.sight_causes import Cause, likeliest


def along(t):
    """A swing along the base line of two cameras, so that a delay hardly shows in the misses and moves much."""
    return np.stack([24 * np.cos(2 * np.pi * t / 1.6), 0.2 * np.sin(5 * t), 0.5 * np.sin(2 * np.pi * t / 0.9)], -1)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("rate", [0.002, -0.002])
def test_a_clock_that_runs_fast_is_named_with_its_rate(n, rate):
    found, over = misses(n, late=rate * AT, path=along)
    assert found.cause.kind == "fast"
    assert 1 in found.cause.cameras
    assert abs(found.cause.amount) == pytest.approx(2000, abs=3 * found.cause.sd + 60)
    assert found.cause.evidence > 20
    assert found.cause.share > 0.9
    assert found.cause.moved == pytest.approx(over, rel=0.25)


def test_a_clock_that_jumps_in_the_run_is_named_with_its_moment():
    found, over = misses(3, late=0.033 * (AT > 4.0))
    assert (found.cause.kind, found.cause.cameras) == ("jumped", (1,))
    assert found.cause.amount == pytest.approx(0.033, rel=0.05)
    assert found.cause.from_s == pytest.approx(4.0, abs=0.6)
    assert found.cause.moved == pytest.approx(over, rel=0.2)


def test_a_clock_that_is_late_neither_runs_nor_jumps():
    found, _ = misses(2, late=0.004, path=along)
    assert found.cause.kind == "late"
    assert found.cause.evidence > 20


def test_of_causes_that_explain_as_much_the_evident_one_is_preferred():
    turned = Cause("turned", (0,), 1.2, 0.4, 1.0, 1.2, 90.0)
    fast = Cause("fast", (1,), 5000.0, 90.0, 0.95, 40.0, 17.0)
    assert likeliest([turned, fast]).kind == "fast"
    assert likeliest([turned, fast._replace(share=0.5)]).kind == "turned"


def test_a_turn_by_more_than_a_camera_can_turn_unseen_is_no_cause_where_a_clock_is_one():
    turned = Cause("turned", (0,), 68.0, 2.0, 1.0, 900.0, 1e4)
    late = Cause("late", (1,), 0.095, 0.003, 0.9, 700.0, 80.0)
    assert likeliest([turned, late]) == late
    assert likeliest([turned._replace(amount=1.3), late]).kind == "turned"
    assert likeliest([turned]).kind == "turned"


def test_a_zoom_by_a_third_that_leaves_a_pixel_is_a_turned_camera():
    zoomed = Cause("all zoomed", (0, 1), 0.3153, 0.0085, 0.95, 900.0, 18.0)
    turned = Cause("turned", (0,), 1.2, 0.4, 0.9, 850.0, 16.0)
    assert likeliest([zoomed, turned]).kind == "turned"
    assert likeliest([zoomed._replace(amount=0.04), turned]).kind == "all zoomed"
