"""Clips in which nothing can be named are refused, a line each, with what would find balls."""

from typing import Any, cast

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.labelling.refusals import common_size, refuse_empty
from vidtrack.labelling.shot import Shot, take
from vidtrack.labelling.still import FrameLike


class Frame:
    corrupt = False

    def __init__(self, luma):
        self.luma = luma


def shot(balls=(), size=(60, 80), ground=20, level=200, **detect: Any) -> Shot:
    luma = np.full(size, ground, np.uint8)
    for x, y in balls:
        luma[y - 2 : y + 3, x - 2 : x + 3] = level
    return take([cast(FrameLike, Frame(luma))], detect)


def test_clips_of_one_size_have_it():
    assert common_size({"row1": shot(), "row2": shot()}, "cam1") == (80, 60)


def test_each_clip_of_another_size_than_the_first_is_named():
    with pytest.raises(VidtrackError) as refused:
        common_size({"row1": shot(), "row2": shot(size=(60, 90)), "row3": shot(size=(50, 80))}, "cam1")
    assert [line.split(":")[0] for line in refused.value.problems] == ["calibration/row2", "calibration/row3"]


def test_a_clip_without_blobs_is_refused_with_the_polarity_that_finds_some():
    dark = shot([(20, 20), (50, 30)], ground=200, level=20, threshold=250)
    refuse_empty({"row1": shot([(20, 20)])}, "cam1")
    with pytest.raises(VidtrackError, match="threshold: auto with polarity: dark finds 2") as refused:
        refuse_empty({"row1": shot([(20, 20)]), "row2": dark}, "cam1")
    assert len(refused.value.problems) == 1


def test_a_clip_in_which_nothing_is_to_be_found_asks_for_the_light():
    with pytest.raises(VidtrackError, match="was the light on"):
        refuse_empty({"row1": shot(threshold=250)}, "cam1")
