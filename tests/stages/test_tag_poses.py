"""The stage gives the poses of coded tags as a table; what they are is tested in tests/tags."""

import numpy as np
import pandas as pd

from tests.motion.tags import SIDE, SQUARE, rig
from tests.tags.test_poses import ORIGIN, T, tables
from vidtrack.stages.tag_poses import table_of, tag_poses
from vidtrack.tags.poses import TagOrder


def test_poses_of_two_tags_are_one_table_below_the_other():
    two = {7: SQUARE, 9: SQUARE + np.array([0, 150.0, 0])}
    seen = {name: pd.DataFrame(columns) for name, columns in tables(1, two).items()}
    table = table_of(tag_poses(seen, {"cam1": (rig(1)[0], None)}, TagOrder(SIDE)))
    assert table["body"].tolist() == ["tag7"] * T + ["tag9"] * T
    own = table[table["body"] == "tag7"].dropna(subset="x")
    moments = (own["time_s"] * 30).round().astype(int)
    assert np.abs(own["x"].to_numpy() - ORIGIN[moments, 0]).max() < 1.0
