"""From a few picks to every ball, and never to a wrong one."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.labelling.configuration import label_with
from vidtrack.labelling.label import Picks, View, agreeing, beyond_doubt, complete, crowding_limit
from vidtrack.labelling.seeds import label_from_picks, on_one_line
from vidtrack.simulate.rig import thesis_points, thesis_rig

SIZE = (512, 480)
TAGS, POINTS = thesis_points()
CAMERAS = thesis_rig()
ROWS = [np.arange(16 * r, 16 * r + 16) for r in range(4)]
HALF_BALL = 4.0  # px: a 2 in ball at 160 in


class Scene:
    """The thesis's four clips as one camera sees them: 0.1 px of noise, 1/16 in of survey error (0.25 px)."""

    def __init__(self, camera=CAMERAS[0], seed=0, missing=3, spurious=5, survey=1 / 16):
        self.rng = rng = np.random.default_rng(seed)
        self.b = project(camera, POINTS + rng.normal(0, survey, POINTS.shape)) + rng.normal(0, 0.1, (64, 2))
        gone = rng.choice(64, missing, replace=False)
        extra = rng.integers(0, 4, spurious)
        self.views, self.truth = [], []
        for r, row in enumerate(ROWS):
            who = np.concatenate([np.setdiff1d(row, gone), np.full((extra == r).sum(), -1)])
            xy = np.where(who[:, None] >= 0, self.b[who], rng.uniform((100, 80), (420, 400), (len(who), 2)))
            order = rng.permutation(len(who))
            self.views.append(View(row, xy[order], np.full((len(who), 2), HALF_BALL)))
            self.truth.append(who[order])

    def picks(self, n, clip, off=10.0, among=None):
        while True:
            chosen = self.rng.choice(ROWS[clip] if among is None else among, n, replace=False)
            if not on_one_line(POINTS[chosen]):
                break
        angle, distance = self.rng.uniform(0, 2 * np.pi, n), off * np.sqrt(self.rng.uniform(0, 1, n))
        shift = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
        return Picks(np.full(n, clip), chosen, self.b[chosen] + shift)

    def wrong(self, labels):
        return sum(
            int((who[blob[blob >= 0]] != view.points[blob >= 0]).sum())
            for view, blob, who in zip(self.views, labels.blob, self.truth, strict=True)
        )


@pytest.mark.parametrize("seed", range(6))
def test_a_few_picks_in_one_clip_name_every_ball_of_all_clips(seed):
    scene = Scene(CAMERAS[seed % 2], seed)
    found = label_with(POINTS, scene.views, scene.picks(4 + seed % 4, seed % 4), SIZE)
    assert len(found) == 1
    assert (found[0].matched, scene.wrong(found[0])) == (61, 0)
    # survey error of 1/16 in is about 0.25 px, less what the fit takes up
    assert 0.2 < found[0].sd < 0.5


def test_a_pick_at_the_neighbouring_ball_is_outvoted():
    scene = Scene(missing=0, spurious=0)
    picks = scene.picks(6, 0, off=3)
    xy = picks.xy.copy()
    xy[2] = scene.b[picks.point[2] ^ 1]
    wrong = picks._replace(xy=xy)
    found = label_with(POINTS, scene.views, wrong, SIZE)
    assert (len(found), found[0].matched, scene.wrong(found[0])) == (1, 64, 0)
    assert (~agreeing(found[0], wrong)).nonzero()[0].tolist() == [2]


@pytest.mark.slow
def test_swapped_picks_are_outvoted():
    scene = Scene(missing=0, spurious=0, seed=4)
    picks = scene.picks(6, 1, off=3)
    swapped = picks._replace(xy=picks.xy[[0, 4, 2, 3, 1, 5]])
    found = label_with(POINTS, scene.views, swapped, SIZE)
    assert (len(found), found[0].matched, scene.wrong(found[0])) == (1, 64, 0)
    assert (~agreeing(found[0], swapped)).nonzero()[0].tolist() == [1, 4]


def test_picks_may_lie_in_several_clips():
    scene = Scene(seed=7)
    chosen = np.array([0, 15, 19, 44, 60])
    picks = Picks(chosen // 16, chosen, scene.b[chosen] + 4)
    found = label_with(POINTS, scene.views, picks, SIZE)
    assert (len(found), found[0].matched, scene.wrong(found[0])) == (1, 61, 0)


def test_a_ball_that_hides_and_a_blob_that_is_no_ball_stay_without_partner():
    scene = Scene(seed=1, missing=10, spurious=20)
    found = label_with(POINTS, scene.views, scene.picks(6, 2, among=np.setdiff1d(scene.truth[2], [-1])), SIZE)
    assert (len(found), found[0].matched, scene.wrong(found[0])) == (1, 54, 0)


def test_two_balls_in_one_blob_are_both_left_out():
    scene = Scene(missing=0, spurious=0)
    view, who = scene.views[0], scene.truth[0]
    i, j = (int(np.flatnonzero(who == t)[0]) for t in (5, 6))
    blobs, reach = view.blobs.copy(), view.reach.copy()
    blobs[i] += (0.5, 0.0)
    reach[i] = np.abs(view.blobs[i] - view.blobs[j]) + HALF_BALL
    keep = np.arange(len(who)) != j
    scene.views[0] = View(view.points, blobs[keep], reach[keep])
    scene.truth[0] = who[keep]
    labels = label_from_picks(POINTS, scene.views, scene.picks(5, 3), SIZE)[0]
    assert labels.merged[0].nonzero()[0].tolist() == [5, 6]
    assert (labels.blob[0][[5, 6]] == -1).all()
    assert labels.matched == 62


def test_no_pose_rests_on_a_blob_that_may_be_several_balls():
    scene = Scene(missing=0, spurious=0)
    labels = label_from_picks(POINTS, scene.views, scene.picks(5, 3), SIZE)[0]
    view = scene.views[0]
    reach = view.reach.copy()
    reach[3] *= 2
    rests_on = [beyond_doubt(labels.pose, POINTS, [own], labels.sd)[2] for own in (view, view._replace(reach=reach))]
    assert 3 in rests_on[0]
    assert set(rests_on[0]) - set(rests_on[1]) == {3}


def test_labels_are_complete_only_when_the_picks_agree():
    scene = Scene(missing=0, spurious=0)
    picks = scene.picks(5, 0)
    labels = label_from_picks(POINTS, scene.views, picks, SIZE)[0]
    assert complete(labels, picks)
    assert not complete(labels, picks._replace(xy=picks.xy[::-1]))


def test_too_few_picks_and_picks_on_one_line_are_told():
    scene = Scene()
    with pytest.raises(ValueError, match="2 picks"):
        label_from_picks(POINTS, scene.views, Picks(np.zeros(2, int), np.arange(2), scene.b[:2]), SIZE)
    assert on_one_line(POINTS[[0, 1, 2, 3]])
    assert not on_one_line(POINTS[[0, 1, 2, 7]])


def test_balls_that_run_into_each_other_do_not_count_where_all_picks_agree():
    scene = Scene(missing=0, spurious=0)
    picks = scene.picks(5, 0)
    labels = label_from_picks(POINTS, scene.views, picks, SIZE)[0]
    blob, shared = ([own.copy() for own in column] for column in (labels.blob, labels.shared))
    blob[1][:14], shared[1][:14] = -1, 0
    blob[2][:14], shared[2][:14] = -1, 0
    crowded = labels._replace(blob=blob, shared=shared)
    assert crowded.share_found(picks) == 1
    assert complete(crowded, picks)
    few = picks._replace(**{name: getattr(picks, name)[:3] for name in picks._fields})
    swapped = picks._replace(xy=picks.xy[::-1])
    assert crowded.share_found(few) == crowded.share_found(swapped) == pytest.approx(36 / 64)
    shared[3][:14], blob[3][:14] = 0, -1  # more than half: nothing says that the view is right
    assert crowded.share_found(picks) == pytest.approx(22 / 64)


def test_picks_that_have_nothing_to_do_with_the_balls_are_not_believed():
    scene = Scene(missing=0, spurious=0)
    rng = np.random.default_rng(5)
    picks = Picks(np.zeros(5, int), np.array([0, 3, 7, 12, 15]), rng.uniform(0, 90, (5, 2)))
    found = label_from_picks(POINTS, scene.views, picks, SIZE)
    assert not any(complete(labels, picks) for labels in found)


def test_a_stray_blob_beside_a_hidden_ball_does_not_take_its_name():
    scene = Scene(missing=0, spurious=0)
    view, who = scene.views[1], scene.truth[1]
    i = int(np.flatnonzero(who == 21)[0])
    blobs = view.blobs.copy()
    blobs[i] += (3.0, 3.0)  # ten times the scatter
    scene.views[1] = view._replace(blobs=blobs)
    labels = label_from_picks(POINTS, scene.views, scene.picks(6, 0), SIZE)[0]
    assert labels.matched == 63
    assert labels.blob[1][5] == -1
    assert labels.nearest[1][5] == pytest.approx(np.hypot(3, 3), abs=0.8)


def test_seeds_alone_outvote_a_pick_at_the_wrong_ball():
    scene = Scene(missing=0, spurious=0, seed=2)
    picks = scene.picks(6, 0, off=3)
    xy = picks.xy.copy()
    xy[4] = scene.b[picks.point[4] ^ 3]
    found = label_from_picks(POINTS, scene.views, picks._replace(xy=xy), SIZE)
    assert (found[0].matched, scene.wrong(found[0])) == (64, 0)


def test_a_match_with_a_second_candidate_is_not_beyond_doubt():
    scene = Scene(missing=0, spurious=0)
    pose = label_from_picks(POINTS, scene.views, scene.picks(6, 0), SIZE)[0].pose
    view = scene.views[0]
    twin = view._replace(blobs=np.vstack([view.blobs, view.blobs[3] + 0.3]), reach=np.full((17, 2), HALF_BALL))
    _, rows, blobs = beyond_doubt(pose, POINTS, [twin], 0.5)
    assert len(rows) == 15
    assert not {3, 16} & set(blobs.tolist())


def stand_in(projected, share=1.0, sd=0.1) -> Any:
    """An answer as far as `agreeing` and `complete` look at it: four blobs 20 px apart."""
    blobs = np.array([(100.0, 100), (120, 100), (100, 120), (120, 120)])
    views = [View(np.arange(4), blobs, np.full((4, 2), 4.0))]
    pose = SimpleNamespace(camera=SimpleNamespace(image_size=(1000, 800)))
    own = {"projected": [np.array(projected, float)], "sd": sd, "share_found": lambda picks: share}
    return cast(Any, SimpleNamespace(views=views, pose=pose, **own))


@pytest.mark.parametrize(
    ("off", "neighbour", "agrees"),
    [(24, 5, True), (26, 30, True), (26, 25, False), (59, 200, True), (61, 200, False)],
)
def test_a_pick_agrees_within_a_fortieth_of_the_width_or_where_no_other_tag_is_nearer(off, neighbour, agrees):
    pick = Picks(np.array([0]), np.array([0]), np.array([(300.0, 300.0)]))
    far = [(900, 700), (900, 600)]
    labels = stand_in([(300 + off, 300), (300, 300 + neighbour), *far])
    assert agreeing(labels, pick).tolist() == [agrees]


NO_PICKS = Picks(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((0, 2)))


@pytest.mark.parametrize(
    ("share", "of_limit", "done"),
    [
        (0.86, 0.7, True),
        (0.86, 0.9, False),
        (0.84, 0.7, False),
        (0.71, 0.3, True),
        (0.71, 0.5, False),
        (0.69, 0.3, False),
    ],
)
def test_the_fewer_balls_are_found_the_closer_they_must_lie(share, of_limit, done):
    labels = stand_in([(0, 0)] * 4, share)
    labels.sd = of_limit * crowding_limit(labels.views)
    assert complete(labels, NO_PICKS) == done
