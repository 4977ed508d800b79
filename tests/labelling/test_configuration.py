"""What a layout of points can tell by itself, and what no picture can."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.camera import project
from vidtrack.geometry.pose import adjust
from vidtrack.labelling.configuration import label_alone, label_with, rivals, self_maps
from vidtrack.labelling.label import Picks, View, grow
from vidtrack.simulate.rig import thesis_points, thesis_rig

SIZE = (512, 480)
TAGS, POINTS = thesis_points()
CAMERA = thesis_rig(1)[0]
ROWS = [np.arange(16 * r, 16 * r + 16) for r in range(4)]


def seen(camera, points, rows, seed=0, noise=0.1):
    rng = np.random.default_rng(seed)
    b = project(camera, points) + rng.normal(0, noise, (len(points), 2))
    truth = [rng.permutation(row) for row in rows]
    return [View(np.sort(who), b[who], np.full((len(who), 2), 4.0)) for who in truth], truth, b


def wrong(labels, views, truth):
    return sum(
        int((who[blob[blob >= 0]] != view.points[blob >= 0]).sum())
        for view, blob, who in zip(views, labels.blob, truth, strict=True)
    )


def test_the_maps_of_a_box_of_points_onto_itself_are_counted():
    # an affine view knows no lengths: any box is a cube to it, with 48 symmetries; rows that must stay leave a
    # square's 8; the identity is not told
    assert len(self_maps(POINTS, [np.arange(64)])) == 47
    assert len(self_maps(POINTS, ROWS)) == 7
    assert len(self_maps(POINTS[:16], [np.arange(16)])) == 7


def test_survey_errors_do_not_hide_a_symmetry():
    surveyed = POINTS + np.random.default_rng(1).normal(0, 1 / 16, POINTS.shape)
    assert len(self_maps(surveyed, ROWS)) == 7


def test_a_map_sends_each_point_to_one_of_its_own_row():
    for image in self_maps(POINTS, ROWS):
        assert sorted(image) == list(range(64))
        assert (image // 16 == np.arange(64) // 16).all()


def test_an_irregular_layout_maps_onto_itself_in_no_way():
    p = np.random.default_rng(0).uniform(-1, 1, (30, 3))
    assert self_maps(p, [np.arange(30)]) == []


def test_points_that_no_clip_shows_map_to_themselves():
    assert all((image[16:] == np.arange(16, 64)).all() for image in self_maps(POINTS, [ROWS[0]]))


@pytest.mark.slow
def test_the_rows_of_the_thesis_look_the_same_upside_down():
    camera = thesis_rig()[0]
    views, truth, _ = seen(camera, POINTS, ROWS)
    found = label_alone(POINTS, views, SIZE)
    assert sorted(wrong(labels, views, truth) for labels in found) == [0, 64]
    assert found[0].sd == pytest.approx(found[1].sd, rel=0.1)


@pytest.mark.slow
def test_one_pick_settles_what_symmetry_leaves_open():
    camera = thesis_rig()[1]
    views, truth, b = seen(camera, POINTS, ROWS)
    found = label_with(POINTS, views, Picks(np.array([2]), np.array([35]), b[[35]] + 6), SIZE)
    assert [wrong(labels, views, truth) for labels in found] == [0]


def test_wires_hung_at_unequal_heights_name_themselves():
    uneven = POINTS + np.random.default_rng(3).uniform(-3, 3, (16, 1)).repeat(4, axis=0) * [0, 0, 1.0]
    views, truth, _ = seen(thesis_rig()[0], uneven, ROWS)
    found = label_alone(uneven, views, SIZE)
    assert [(labels.matched, wrong(labels, views, truth)) for labels in found] == [(64, 0)]


def test_scattered_points_in_one_clip_name_themselves():
    p = np.random.default_rng(8).uniform(-1, 1, (25, 3)) * [30, 20, 15]
    views, truth, _ = seen(thesis_rig()[1], p, [np.arange(25)])
    found = label_alone(p, views, SIZE)
    assert [(labels.matched, wrong(labels, views, truth)) for labels in found] == [(25, 0)]


def test_blobs_that_are_something_else_get_no_names():
    rng = np.random.default_rng(1)
    views = [View(np.arange(30), rng.uniform(50, 450, (30, 2)), np.full((30, 2), 4.0))]
    assert label_alone(rng.uniform(-1, 1, (30, 3)), views, SIZE) == []


def test_five_points_are_too_few_to_name_themselves():
    views, _, _ = seen(thesis_rig()[0], POINTS[:5], [np.arange(5)])
    assert label_alone(POINTS[:5], views, SIZE) == []


def names_of_whatever_the_clips_show(seed):
    """Few blobs, blobs on one line or at one place, points on one line or in a plane, picks anywhere."""
    rng = np.random.default_rng(seed)
    n, kind = int(rng.integers(1, 20)), int(rng.integers(0, 6))
    p = POINTS[rng.choice(64, n, replace=False)] if kind < 3 else rng.normal(size=(n, 3)) * 10 ** rng.uniform(-3, 3)
    p = p * {3: [1, 0, 0], 4: [1, 1, 0], 5: [0, 0, 0]}.get(kind, [1, 1, 1])
    views = []
    for _ in range(int(rng.integers(1, 3))):
        row = np.sort(rng.choice(n, int(rng.integers(1, n + 1)), replace=False))
        blobs = rng.uniform(0, 480, (int(rng.integers(0, 12)), 2)) if rng.random() < 0.5 else project(CAMERA, p[row])
        if rng.random() < 0.3:
            blobs = blobs * [1, 0] + [0, 7]
        views.append(View(row, blobs, np.full((len(blobs), 2), 4.0)))
    view = rng.integers(0, len(views), int(rng.integers(0, 6)))
    point = np.array([rng.choice(views[v].points) for v in view], int)
    for labels in label_with(p, views, Picks(view, point, rng.uniform(0, 480, (len(view), 2))), SIZE):
        assert labels.matched >= 4


@pytest.mark.parametrize("seed", [3327, 2165, 4])
def test_clips_that_once_ended_it_give_labels_or_none(seed):
    names_of_whatever_the_clips_show(seed)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 100_000))
def test_whatever_the_clips_show_the_answer_is_labels_or_none(seed):
    names_of_whatever_the_clips_show(seed)


@pytest.mark.parametrize(("rows", "count"), [(ROWS[:2], 1), (ROWS[:1], 0)])
def test_two_rows_look_the_same_from_behind_and_perspective_tells_the_ends_of_one(rows, count):
    points = POINTS[: 16 * len(rows)]
    views, _, b = seen(CAMERA, points, rows)
    start = adjust(CAMERA, points, b, 0.1)
    assert start is not None
    labels = grow(start, points, views)
    assert labels is not None
    assert len(rivals(labels, points, views)) == count
