"""A camera that was knocked between clips is noticed, and the balls keep their names."""

import numpy as np
import pytest

from tests.labelling.test_label import CAMERAS, POINTS, SIZE, Scene
from vidtrack.labelling.knock import moved, shifted
from vidtrack.labelling.seeds import label_from_picks


def knocked(offset, clip=2, seed=0):
    scene = Scene(CAMERAS[seed % 2], seed, missing=0, spurious=0)
    view = scene.views[clip]
    scene.views[clip] = view._replace(blobs=view.blobs + np.array(offset, float))
    return scene, label_from_picks(POINTS, scene.views, scene.picks(6, 0), SIZE)[0]


def test_a_clip_that_lies_elsewhere_as_a_whole_is_still_named():
    scene, labels = knocked((5, -6))
    shift = shifted(labels, 2)
    assert shift is not None
    assert shift.offset == pytest.approx([5, -6], abs=0.5)
    assert (scene.truth[2][shift.blob] == scene.views[2].points).all()
    assert shifted(labels, 0) is None


@pytest.mark.parametrize("seed", range(3))
def test_a_small_knock_that_the_fit_could_swallow_is_told_with_its_size(seed):
    _, labels = knocked((2, 1), seed=seed)
    assert labels.matched == 64
    offset = moved(labels, POINTS)
    # the other clips know the place to about 0.2 px
    assert list(offset) == [2]
    assert offset[2] == pytest.approx([2, 1], abs=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_a_camera_that_stands_still_is_not_accused(seed):
    _, labels = knocked((0, 0), seed=seed)
    assert moved(labels, POINTS) == {}


def test_a_single_clip_cannot_tell():
    scene = Scene(missing=0, spurious=0)
    labels = label_from_picks(POINTS, scene.views[:1], scene.picks(6, 0), SIZE)[0]
    assert moved(labels, POINTS) == {}
