"""A clip whose pictures are mirrored or upside down is noticed, and how."""

import numpy as np
import pytest

from tests.labelling.test_label import CAMERAS, POINTS, SIZE, Scene
from vidtrack.labelling.flipped import WAYS, flipped
from vidtrack.labelling.seeds import label_from_picks


def labelled(way=None, clip=2, seed=0):
    scene = Scene(CAMERAS[seed % 2], seed, missing=0, spurious=0)
    if way:
        view = scene.views[clip]
        back = np.where(np.array(WAYS[way]) < 0, np.array(SIZE) - 1 - view.blobs, view.blobs)
        scene.views[clip] = view._replace(blobs=back)
    return label_from_picks(POINTS, scene.views, scene.picks(6, 0), SIZE)[0]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("seed", range(2))
def test_the_way_in_which_one_clip_is_flipped_is_named(way, seed):
    labels = labelled(way, seed=seed)
    assert [flipped(labels, i, SIZE) for i in range(len(labels.views))] == [
        way if i == 2 else None for i in range(len(labels.views))
    ]


def test_clips_as_they_are_and_clips_that_show_something_else_are_not_flipped():
    labels = labelled()
    assert [flipped(labels, i, SIZE) for i in range(len(labels.views))] == [None] * len(labels.views)
    elsewhere = labels._replace(blob=[np.full_like(blob, -1) for blob in labels.blob])
    views = [view._replace(blobs=np.random.default_rng(3).uniform(0, SIZE, view.blobs.shape)) for view in labels.views]
    assert flipped(elsewhere._replace(views=views), 2, SIZE) is None
    assert flipped(elsewhere._replace(views=[view._replace(blobs=np.zeros((0, 2))) for view in views]), 2, SIZE) is None
