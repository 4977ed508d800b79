"""Bars about a picture are found by their flatness and the step where the picture begins; a dark wall is no bar."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.steadiness.bars import LEAST, STEP, bars_of, bars_record

SIZE = (240, 320)


def film(rng, level=30.0, noise=0.4):
    """The mean of some pictures of a plain wall."""
    return (level + rng.normal(0, noise, SIZE)).astype(np.float32)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.sampled_from([0, 16, 40])] * 4), st.sampled_from([0.0, 16.0, 120.0]), st.integers(0, 99))
def test_a_film_set_into_a_larger_picture_has_the_bars_that_were_put_about_it(wide, level, seed):
    left, top, right, bottom = wide
    framed = np.pad(film(np.random.default_rng(seed)), ((top, bottom), (left, right)), constant_values=level)
    assert bars_of(framed) == wide
    assert bars_of(framed, 2) == tuple(2 * px for px in wide)


def test_the_edge_may_be_soft_as_scaling_and_coding_leave_it():
    framed = np.pad(film(np.random.default_rng(1)), 40)
    soft = cv2.GaussianBlur(framed, (0, 0), 0.7)
    assert bars_of(soft) == pytest.approx((40, 40, 40, 40), abs=2)


def test_a_flat_wall_with_a_ball_before_it_has_no_bars():
    wall = np.full(SIZE, 20.0, np.float32)
    wall[100:110, 150:160] = 200
    assert bars_of(wall) == (0, 0, 0, 0)


def test_a_black_wall_that_ends_in_a_slope_or_along_half_of_the_edge_is_no_bar():
    slope = np.clip(np.arange(SIZE[0], dtype=np.float32) - 40, 0, None)[:, None] * np.ones(SIZE[1], np.float32)
    assert bars_of(slope * STEP / 10) == (0, 0, 0, 0)
    half = film(np.random.default_rng(2))
    half[:40] = 0
    half[40:60, :200] = 0
    assert bars_of(half) == (0, 0, 0, 0)


def test_the_blanking_of_a_tape_is_no_bar():
    taped = film(np.random.default_rng(3))
    px = int(LEAST * SIZE[1]) - 1
    taped[:, :px] = taped[:, -px:] = 0
    assert bars_of(taped) == (0, 0, 0, 0)


@pytest.mark.parametrize("picture", [np.zeros((1, 1)), np.zeros((5, 900)), np.full(SIZE, 7.0)])
def test_a_picture_of_nothing_has_no_bars(picture):
    assert bars_of(picture) == (0, 0, 0, 0)


def test_the_record_has_bars_where_there_are_some():
    framed = np.pad(film(np.random.default_rng(1)), 40)
    assert bars_record(framed, 2) == {"bars": [80, 80, 80, 80]}
    assert bars_record(film(np.random.default_rng(1))) == bars_record(None) == {}
