"""Balls that swing and clips that disagree are named, and noise is neither."""

from types import SimpleNamespace as Thing

import numpy as np
import pandas as pd
import pytest

from tests.labelling.test_naming_doubts import POINTS, SIZE, case
from vidtrack.labelling.doubts import (
    DISAGREE,
    ONE_PLACE,
    SWING,
    clip_moved,
    coinciding,
    disagreeing,
    swinging,
    with_picked,
)
from vidtrack.labelling.seeds import label_from_picks


def rows(**columns):
    usual = {"clip": "row1", "tag": ["1", "2", "3", "4"], "scatter": 0.02, "found": True, "Xf": 10.0, "Yf": 20.0}
    return pd.DataFrame({**usual, "sd_x": 0.05, "sd_y": 0.05, **columns})


@pytest.mark.parametrize(
    ("scatter", "named"),
    [
        ([0.02, 0.02, SWING + 0.01, 0.02], ["3"]),
        ([0.02, 0.02, SWING - 0.01, 0.02], []),
        ([0.1, 0.1, 0.45, 0.1], []),  # a picture in which every ball scatters
        ([0.1, 0.1, 0.55, 0.1], ["3"]),
    ],
)
def test_a_ball_swings_that_moves_by_much_and_by_more_than_the_others(scatter, named):
    found = swinging(rows(scatter=scatter), "cam1")
    assert [f.text.split("tag ")[1].split()[0] for f in found] == named
    assert all((f.level, f.code) == ("doubtful", "ball-swings") for f in found)


def test_all_balls_of_a_frame_that_swings_are_one_finding_though_none_moves_by_more_than_the_others():
    (found,) = swinging(rows(scatter=[0.9, 1.1, 1.0, 1.2]), "cam1")
    assert found.text == "calibration/row1: tags 1, 2, 3, 4 move up to 1.20 px rms within the clip of camera cam1."
    assert "the camera that shakes" in found.cure


def test_each_clip_has_a_finding_of_its_own():
    found = swinging(rows(clip=["a", "a", "b", "b"], scatter=[0.9, 0.02, 1.0, 1.2]), "cam1")
    assert [f.text.split(" px")[0] for f in found] == [
        "calibration/a: tag 1 moves 0.90",
        "calibration/b: tags 3, 4 move up to 1.20",
    ]


@pytest.mark.parametrize(
    ("apart", "sd", "said"), [(0.6, 0.01, True), (DISAGREE - 0.01, 0.01, False), (0.6, 0.1, False)]
)
def test_two_clips_disagree_on_a_tag_by_more_than_noise_explains(apart, sd, said):
    table = rows(tag=["1", "1", "2", "3"], clip=["a", "b", "a", "b"], Xf=[10, 10 + apart, 50, 90], sd_x=sd, sd_y=sd)
    found = disagreeing(table, "cam1")
    assert len(found) == said
    if said:
        assert found[0].text == "calibration/b: tag 1 of camera cam1 lies (+0.6, +0.0) px from where a has it."


def test_many_tags_of_which_two_clips_disagree_are_one_finding():
    tags = [str(k) for k in range(8)]
    one = pd.DataFrame({"clip": "a", "tag": tags, "found": True, "Xf": 10.0, "Yf": 20.0, "sd_x": 0.05, "sd_y": 0.05})
    (found,) = disagreeing(pd.concat([one, one.assign(clip="b", Xf=13.0)], ignore_index=True), "cam1")
    assert "calibration/b: tags 0, 1, 2, 3, 4, 5, 6, 7 of camera cam1 lie (+3.0, +0.0) px (median)" in found.text


def test_a_tag_that_was_not_found_disagrees_with_nothing():
    table = rows(tag="1", Xf=[10.0, 99.0, 10.0, 10.0], found=[True, False, True, True])
    assert disagreeing(table, "cam1") == []


def test_a_clip_that_moved_says_which_and_how_far():
    found = clip_moved(Thing(clips=["a", "b"], camera="cam2"), 1, np.array([3.14, -2.0]))
    assert "calibration/b: the balls of camera cam2 lie (+3.1, -2.0) px" in found.text


@pytest.mark.parametrize(("share", "named"), [(0.0, ["3 and 5"]), (0.9, ["3 and 5"]), (1.1, [])])
def test_two_tags_at_one_place_are_named(share, named):
    x = np.array([0.0, 8.0, 16.0, 24.0, 16.0 + share * ONE_PLACE * 8.0, 32.0])
    found = coinciding(pd.DataFrame({"clip": "row1", "tag": list("123456"), "x": x, "y": 0.0, "z": 0.0}))
    assert [f.text.split("tags ")[1].split(",")[0] for f in found] == named


def test_two_clips_may_show_balls_at_one_place():
    once = pd.DataFrame({"clip": "front", "tag": list("1234"), "x": [0.0, 8.0, 16.0, 24.0], "y": 0.0, "z": 0.0})
    moved = once.assign(clip="rear", tag=list("5678"))
    assert not coinciding(pd.concat([once, moved]))
    assert len(coinciding(pd.concat([once, moved.assign(clip="front")]))) == 4


def test_a_ball_that_a_pick_names_against_the_survey_is_taken_and_a_pick_at_anothers_ball_is_not():
    c = case([0, 3, 17, 19, 27, 35])
    (right,) = label_from_picks(POINTS, c.views, c.picks, SIZE)
    blob, projected = [each.copy() for each in right.blob], [each.copy() for each in right.projected]
    blob[1][5], projected[1][5] = -1, (600.0, 40.0)  # where a mistyped row of points.csv would have it
    labels = right._replace(blob=blob, projected=projected)
    taken, (finding,) = with_picked(c, labels)
    assert (labels.blob[1][5], taken.blob[1][5]) == (-1, 5)
    assert (finding.level, finding.code) == ("doubtful", "pick-contradicted")
    assert finding.cure == f"Check tag {c.tags[17]} in points.csv, and this pick."
    at_another = c.picks.xy.copy()
    at_another[2] = c.views[1].blobs[6]
    kept, (finding,) = with_picked(case([0, 3, 17, 19, 27, 35], at_another), labels)
    assert (kept.blob[1][5], finding.code) == (-1, "pick-not-used")
