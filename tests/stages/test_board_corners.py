"""One camera's clips of a board: which pictures are searched, and what is said of a clip that does not show it."""

import re
from fractions import Fraction

import numpy as np
import pytest

from tests.simulate.test_board_picture import shown
from vidtrack.calibration.boards.board import Board
from vidtrack.errors import VidtrackError
from vidtrack.stages.board_corners import MOST_PICTURES, board_corners, stride
from vidtrack.timing.frame import Frame


def frames(*pictures):
    return [Frame(i, Fraction(i, 30), picture, False, None) for i, picture in enumerate(pictures)]


def test_every_nth_picture_is_looked_at_and_counted():
    picture, _ = shown("charuco")
    found = board_corners(
        {"board": frames(*[picture] * 5)},
        {"board": Board("charuco", 7, 5, 30.0)},
        camera="c",
        bits={"board": 8},
        every=2,
    )
    assert sorted(set(found.table["frame"])) == [0, 2, 4]
    assert found.record["clips"]["board"] == {"pictures": 3, "with_board": 3, "every": 2}
    assert found.background.shape == picture.shape


def test_a_clip_without_the_board_is_named_with_the_likeliest_reason():
    picture, _ = shown("charuco")
    mirrored = np.ascontiguousarray(picture[:, ::-1])
    found = board_corners(
        {"board": frames(mirrored)}, {"board": Board("charuco", 7, 5, 30.0)}, camera="c", bits={"board": 8}, every=1
    )
    (finding,) = found.findings
    assert finding.level == "bad"
    assert re.search(r"calibration/board: camera c shows no charuco.*mirrored", finding.text)
    assert len(found.table) == 0
    assert found.record["clips"]["board"]["with_board"] == 0


def test_clips_without_any_picture_are_refused():
    with pytest.raises(VidtrackError, match="no picture"):
        board_corners(
            {"board": frames()}, {"board": Board("charuco", 7, 5, 30.0)}, camera="c", bits={"board": 8}, every=1
        )


def test_deep_pictures_are_read_as_their_bits_say():
    picture, _ = shown("charuco")
    deep = (picture.astype(np.uint16) << 4).astype(np.uint16)
    found = board_corners(
        {"board": frames(deep)}, {"board": Board("charuco", 7, 5, 30.0)}, camera="c", bits={"board": 12}, every=1
    )
    assert len(found.table) > 15


@pytest.mark.parametrize(("clips", "every"), [(0, 1), (1, 1), (1.01, 2), (2, 2), (2.01, 4), (4.5, 8)])
def test_long_clips_are_searched_in_every_so_many_pictures_a_power_of_two(clips, every):
    assert stride(int(clips * MOST_PICTURES)) == every
