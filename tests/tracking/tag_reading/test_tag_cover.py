"""Tags are painted over with their paper, and nothing else is."""

import numpy as np
import pytest

from tests.tracking.tag_reading.test_tag_corners import shown
from vidtrack.tracking.tag_reading.tag_cover import cover, near


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, 0.3, 0.1), (-0.2, 0.5, 0.8)])
def test_neither_tag_nor_paper_is_left(turn):
    """The paper reaches 0.8 of a side beyond the tag; nothing remains 20 levels from the background."""
    picture, corners = shown(side_px=40.0, turn=turn)
    before = picture.copy()
    hull = cover(picture, corners, 8)
    assert (np.abs(before.astype(int) - 110) > 60).mean() > 0.1
    assert np.abs(picture.astype(int) - 110).max() < 20
    assert near(corners, np.zeros(4), [hull]).all()


def test_what_is_away_from_the_paper_stays_as_it_is():
    picture, corners = shown(side_px=40.0)
    picture[5:9, 5:9] = 240
    before = picture.copy()
    hull = cover(picture, corners, 8)
    assert np.array_equal(picture[:20, :20], before[:20, :20])
    spots = np.array([[7.0, 7.0], hull[0] + [0.5, 0], corners.mean(0), [np.nan, 1]])
    assert near(spots, np.array([2.0, 2, 2, 2]), [hull]).tolist() == [False, True, True, False]


def test_a_tag_outside_the_picture_covers_nothing():
    picture, corners = shown(side_px=40.0)
    before = picture.copy()
    assert cover(picture, corners + 1000, 8) is None
    assert np.array_equal(picture, before)
