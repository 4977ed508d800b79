"""What a run will know in space, from first sights of its targets."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.camera import project
from vidtrack.preview.space import expected
from vidtrack.simulate.rig import thesis_points, thesis_rig

PLACES = {"bow": np.array([3.0, 2.0, 1.0]), "stern": np.array([-6.0, 4.0, -3.0])}


def first_sights(names):
    """Calibrations and centroids by camera; `names`: by camera, the targets as their boxes are named."""
    tags, points = thesis_points()
    table = pd.DataFrame(points, columns=list("xyz")).assign(tag=tags)
    rig = dict(zip(names, thesis_rig(), strict=True))
    known = {c: SimpleNamespace(camera=camera, uncertainty=None, points=table) for c, camera in rig.items()}
    rows = {c: [project(rig[c], p) for p in PLACES.values()] for c in names}
    seen = {c: pd.DataFrame(rows[c], columns=["Xf", "Yf"]).assign(target=names[c], sd_x=0.03, sd_y=0.03) for c in names}
    return known, seen


def test_targets_start_where_their_first_sights_meet():
    answer = expected(*first_sights({"a": ["bow", "stern"], "b": ["bow", "stern"]}), ["bow", "stern"])
    for name, place in PLACES.items():
        where, outside, miss = answer.starts[name]
        assert where == pytest.approx(place, abs=1e-6)
        assert (outside, miss) == (0, pytest.approx(0, abs=1e-6))


def test_names_that_are_exchanged_in_one_camera_miss_each_other_by_many_pixels():
    answer = expected(*first_sights({"a": ["bow", "stern"], "b": ["stern", "bow"]}), ["bow", "stern"])
    assert min(miss for *_, miss in answer.starts.values()) > 3
