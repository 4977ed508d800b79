"""Balls that share a blob are measured by one fit, or not at all."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.labelling.test_shot import balls, clip
from vidtrack.labelling.shot import take
from vidtrack.labelling.touching import TOUCHING, separated

ALONE = np.array([(20.3, 20.6), (100.2, 24.4), (24.7, 70.1), (104.4, 68.8)])
PAIR = np.array([(60.2, 44.3), (66.7, 45.1)])  # radius 4: their discs touch


def scene(pair=PAIR, expected=None, *, dark=False, noise=1.0, sd=0.3) -> tuple[Any, Any]:
    """A shot of single balls and one blob of several, and what labels say of its view."""
    everywhere = np.concatenate([ALONE, pair])
    image = balls(everywhere, level=20.0, background=200.0) if dark else balls(everywhere)
    shot = take(clip(image, 8, noise=noise), {"polarity": "dark"} if dark else {})
    nearest = np.linalg.norm(everywhere[:, None] - shot.at, axis=-1).argmin(axis=1)
    one = np.bincount(nearest)[nearest] == 1
    labels = SimpleNamespace(
        shared=[np.where(one, -1, nearest)],
        blob=[np.where(one, nearest, -1)],
        projected=[everywhere if expected is None else np.concatenate([ALONE, expected])],
        sd=sd,
    )
    return shot, labels


@pytest.mark.parametrize("dark", [False, True])
def test_two_balls_of_one_blob_are_measured_each_to_a_tenth_of_a_pixel(dark):
    shot, labels = scene(expected=PAIR + np.array([(0.5, -0.4), (-0.3, 0.5)]), dark=dark)
    found = separated(shot, labels, 0)
    assert found.row.tolist() == [4, 5]
    assert np.abs(found.at - PAIR).max() < 0.1
    assert (found.sd >= TOUCHING.model_px).all()
    assert found.sd.max() < 0.1
    assert found.pixels == pytest.approx([np.pi * 16] * 2, rel=0.15)


def test_balls_that_have_a_blob_each_are_left_alone():
    shot, labels = scene(pair=np.array([(60.0, 44.0)]))
    assert separated(shot, labels, 0).row.size == 0


def test_a_fit_that_ends_elsewhere_than_the_labels_say_measures_none_of_its_group():
    shot, labels = scene(expected=PAIR + 2.0, sd=0.01)
    assert separated(shot, labels, 0).row.size == 0


@pytest.mark.parametrize("unknown", [np.nan, np.inf])
def test_a_ball_whose_place_is_not_known_leaves_its_group_unmeasured(unknown):
    shot, labels = scene(expected=np.array([PAIR[0], [unknown, 45.0]]))
    assert separated(shot, labels, 0).row.size == 0


def test_more_balls_than_a_fit_can_separate_are_left_unmeasured():
    row = np.stack([48.0 + 6.6 * np.arange(TOUCHING.at_most + 1), np.full(TOUCHING.at_most + 1, 44.0)], axis=-1)
    shot, labels = scene(pair=row)
    assert (labels.shared[0] >= 0).sum() == TOUCHING.at_most + 1
    assert separated(shot, labels, 0).row.size == 0


def test_as_many_balls_as_a_fit_may_have_are_measured():
    row = np.stack([48.3 + 6.6 * np.arange(TOUCHING.at_most), np.full(TOUCHING.at_most, 44.2)], axis=-1)
    shot, labels = scene(pair=row)
    found = separated(shot, labels, 0)
    assert len(found.row) == TOUCHING.at_most
    assert np.abs(found.at - row).max() < 0.2


def test_two_balls_at_the_pictures_edge_are_measured_too():
    pair = np.array([(118.3, 44.3), (123.0, 50.2)])  # the second reaches to 127.0 of 127.5
    shot, labels = scene(pair=pair, expected=pair + 0.2)
    found = separated(shot, labels, 0)
    assert np.abs(found.at - pair).max() < 0.15


def test_a_third_ball_beside_the_pair_is_hidden_from_its_fit():
    beside = np.array([(60.4, 57.8)])
    both = np.concatenate([PAIR, beside])
    shot, labels = scene(pair=both)
    found = separated(shot, labels, 0)
    assert found.row.tolist() == [4, 5]
    assert np.abs(found.at - PAIR).max() < 0.12
