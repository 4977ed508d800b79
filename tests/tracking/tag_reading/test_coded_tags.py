"""Coded tags are found, read, and each of them once."""

import numpy as np
import pytest

from tests.tracking.tag_reading.test_tag_corners import shown
from vidtrack.tracking.tag_reading.coded_tags import FAMILIES, TagFinder


def test_a_tag_is_read_with_its_corners_from_the_upper_left_round():
    picture, truth = shown(side_px=60, number=7)
    found = TagFinder("36h11").found(picture)
    assert found.ids.tolist() == [7]
    assert np.abs(found.corners[0] - truth).max() < 1.5


def test_no_tag_is_found_twice_in_one_place():
    for turn in np.linspace(0, 1.2, 7):
        picture, _ = shown(side_px=50, number=7, turn=(0.3, turn, 0.1))
        assert TagFinder("36h11").found(picture).ids.tolist() == [7]


def test_two_tags_of_one_number_are_both_found():
    one, _ = shown(side_px=50, number=3)
    assert TagFinder("36h11").found(np.hstack([one, one])).ids.tolist() == [3, 3]


def test_a_mirrored_tag_and_one_of_another_family_are_not_read():
    picture, _ = shown(side_px=60, number=7)
    assert not TagFinder("36h11").found(np.ascontiguousarray(picture[:, ::-1])).ids.size
    assert not TagFinder("25h9").found(picture).ids.size


def test_noise_alone_shows_no_tag():
    noise = np.random.default_rng(0).integers(0, 255, (480, 640)).astype(np.uint8)
    for family in FAMILIES:
        assert not TagFinder(family).found(noise).ids.size


def test_there_are_no_other_families():
    with pytest.raises(KeyError):
        TagFinder("41h12")
