"""Candidates of consecutive samples linked to trails, and which trails are targets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.initiation.trails import Trail, best_together, compactness, link, merit, moves
from vidtrack.tracking.sample import Sample

SHAPE = (200, 300)


def blobs(*at, pixels=50, contrast=150.0):
    """Blobs at (x, y), 8 px wide and high."""
    x, y = np.array(at, float).reshape(-1, 2).T
    n = x.size
    pixels = np.broadcast_to(pixels, n)
    side = np.full(n, 8)
    rest = Blobs(*np.zeros((15, n)))
    return rest._replace(Xf=x, Yf=y, pixels=pixels, mass=pixels * contrast, width=side, height=side)


def linked(found):
    return link(found, [Sample(np.zeros(SHAPE, np.uint8), float(k)) for k in range(len(found))], Detection.max_step)


def trail(x, *, first=0, size=(8.0, 8.0), pixels=50.0, contrast=150.0, y=50.0):
    x = np.asarray(x, float)
    m = x.size
    pixels = np.broadcast_to(np.asarray(pixels, float), m)
    position = np.stack([x, np.full(m, y)], axis=-1)
    return Trail(
        first + np.arange(m), position, pixels, np.full(m, contrast), np.tile(size, (m, 1)), pixels / np.prod(size)
    )


@settings(max_examples=25, deadline=None)
@given(st.permutations(range(3)), st.floats(-8, 8))
def test_things_on_straight_courses_are_linked_whatever_the_order_of_the_blobs(order, speed):
    start = np.array([[100.0, 40.0], [150.0, 100.0], [200.0, 160.0]])
    found = [blobs(*np.add(start, (k * speed, 0.0))[list(order) if k % 2 else [0, 1, 2]]) for k in range(6)]
    trails = linked(found)
    assert len(trails) == 3
    for one in trails:
        assert one.sample.tolist() == list(range(6))
        assert np.ptp(one.position[:, 1]) == 0
        assert np.allclose(np.diff(one.position[:, 0]), speed)


def test_two_that_cross_go_on_the_way_they_were_going():
    x = 100 + 6.0 * np.arange(9)
    trails = linked([blobs((a, 60.0 + 2 * k), (250.0 - a, 64.0 + 2 * k)) for k, a in enumerate(x)])
    assert len(trails) == 2
    steps = sorted(np.diff(one.position[:, 0]).tolist() for one in trails)
    assert steps == [[-6.0] * 8, [6.0] * 8]


def test_a_gap_of_one_sample_is_bridged_and_one_of_two_is_not():
    def with_gap(*gone):
        return [blobs() if k in gone else blobs((50 + 5.0 * k, 60.0)) for k in range(9)]

    assert [one.sample.tolist() for one in linked(with_gap(4))] == [[0, 1, 2, 3, 5, 6, 7, 8]]
    assert [one.sample.tolist() for one in linked(with_gap(4, 5))] == [[0, 1, 2, 3], [6, 7, 8]]


@pytest.mark.parametrize("other", [{"pixels": 110}, {"contrast": 80.0}])
def test_what_changes_its_size_or_contrast_at_once_is_another_thing(other):
    found = [blobs((50.0 + k, 60.0), **(other if k > 2 else {})) for k in range(6)]
    assert [one.sample.tolist() for one in linked(found)] == [[0, 1, 2], [3, 4, 5]]


def test_a_trail_moves_when_it_is_long_enough_and_goes_far_enough():
    assert moves(trail([10, 11, 12]), 1.5)
    assert not moves(trail([10, 11, 11.4]), 1.5)
    assert not moves(trail([10, 30]), 1.5)


def test_what_jumps_about_one_place_does_not_move_and_what_swings_does():
    """Digits of a running time, as in a film of `benchmarks/disturbed.py`: 4 px to and fro, 3 px wide."""
    digits = trail([110.4, 107.9, 109.1, 109.4, 106.6], size=(3.0, 5.0))
    assert not moves(digits, 1.5)
    assert not moves(digits._replace(sample=np.array([0, 2, 3, 5, 6])), 1.5)
    assert moves(trail(50 + 2 * np.sin(2 * np.pi * np.arange(12) / 6)), 1.5)
    assert moves(trail([50, 56, 50, 56, 50, 56], size=(2.0, 2.0)), 1.5)


def test_what_creeps_moves_though_the_rows_of_its_fields_place_it_to_and_fro():
    """A ball of 12 px in fields that goes 0.3 px in each, as a film of DV showed it."""
    x = [575.68, 575.56, 576.44, 576.31, 576.83, 576.82]
    y = np.array([455.46, 455.09, 455.91, 455.89, 456.52, 456.61])
    one = trail(x, size=(12.0, 6.0))
    assert moves(one._replace(position=np.stack([x, y], axis=-1)), 1.2)


def test_what_leaps_once_and_stands_before_and_after_does_not_move():
    """A speck that a coder leaves, and another one 7 px from it."""
    assert not moves(trail([80.3, 80.1, 73.4, 73.4, 73.4, 73.4], size=(5.0, 4.0)), 1.5)
    assert moves(trail([80.3, 80.1, 78.4, 73.4]), 1.5)


def test_a_square_is_compact_and_a_rope_is_not():
    assert compactness(trail([1, 2, 3], pixels=64.0)) == 1
    assert compactness(trail([1, 2, 3], size=(4.0, 16.0), pixels=64.0)) == 0.25
    steady, changing = trail(3.0 * np.arange(6)), trail(3.0 * np.arange(6), pixels=[30.0, 70, 30, 70, 30, 70])
    assert merit(steady) > merit(changing)
    assert merit(steady) > merit(trail([0.0, 9, 3, 18, 6, 20]))
    assert merit(steady) == pytest.approx(2 * merit(trail(3.0 * np.arange(6), contrast=75.0)))


def test_the_best_together_were_in_view_together_and_never_in_one_place():
    best, piece_of_it = trail([10, 20, 30]), trail([60, 70, 80], first=5)
    double, other = trail([12, 21, 29]), trail([10, 20, 30], y=90.0)
    chosen = best_together([best, piece_of_it, double, other], 4, 8)
    assert [id(one) for one in chosen] == [id(best), id(other)]
    assert best_together([best, other], 1, 8)[0] is best
