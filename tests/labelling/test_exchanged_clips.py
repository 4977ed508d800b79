"""Clips that have each other's tags are named; clips that are wrong otherwise are not called exchanged."""

import numpy as np
import pytest

from tests.labelling.test_label import CAMERAS, POINTS, ROWS, SIZE, TAGS, Scene
from vidtrack.errors import VidtrackError
from vidtrack.labelling.configuration import label_with
from vidtrack.labelling.exchanged_clips import exchanged, settled_or_exchanged
from vidtrack.labelling.label import Picks
from vidtrack.labelling.naming_doubts import Case

CLIPS = ["row1", "row2", "row3", "row4"]


def case(order=(0, 1, 2), picked=0, seed=0, clips=3):
    """Clip i has the tags of row order[i], and shows row i; picks lie in the clip that shows row `picked`."""
    scene = Scene(CAMERAS[0], seed, missing=0, spurious=0)
    views = [view._replace(points=ROWS[k]) for view, k in zip(scene.views[:clips], order, strict=True)]
    chosen = ROWS[picked][[0, 3, 5, 10, 12, 15]]
    holds = order.index(picked) if picked in order else picked
    picks = Picks(np.full(6, holds), chosen, scene.b[chosen] + 2.0)
    where = [f"calibration/{CLIPS[holds]}/picks.csv, line {i + 2}" for i in range(6)]
    return Case("cam1", CLIPS[:clips], TAGS, POINTS, views, picks, where, SIZE)


def answer(own):
    return settled_or_exchanged(own, label_with(own.points, own.views, own.picks, own.image_size))


@pytest.mark.slow
def test_two_clips_with_each_others_tags_are_named():
    with pytest.raises(VidtrackError) as told:
        answer(case((0, 2, 1)))
    line = str(told.value)
    assert "camera cam1: clip row2 shows the tags of clip row3, clip row3 shows the tags of clip row2" in line
    assert "48 of 48 balls lie where they should" in line


@pytest.mark.slow
def test_the_clip_with_the_picks_may_be_one_of_them():
    with pytest.raises(VidtrackError, match="clip row1 shows the tags of clip row2"):
        answer(case((1, 0, 2)))


@pytest.mark.slow
def test_clips_as_they_should_be_are_named_without_a_word():
    own = case()
    assert answer(own).matched == 48
    assert exchanged(own) == ""


@pytest.mark.slow
def test_a_clip_that_shows_something_else_is_not_called_exchanged():
    own = case()
    views = list(own.views)
    views[2] = views[2]._replace(blobs=np.random.default_rng(3).uniform(50, 400, views[2].blobs.shape))
    assert exchanged(own._replace(views=views)) == ""
