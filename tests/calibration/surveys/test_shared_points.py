import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.surveys.shared_points import side_by_side


def _table(tags, shift=0.0, **more):
    n = len(tags)
    places = {"x": np.arange(n) * 1.0, "y": np.zeros(n), "z": np.zeros(n)}
    places["x"] = np.array([float(t) for t in tags])
    return pd.DataFrame({"tag": tags, **places, "Xf": places["x"] + shift, "Yf": 0.0, **more})


def test_points_come_side_by_side_by_tag_whatever_their_order():
    shared = side_by_side([_table(["1", "2", "3"]), _table(["3", "4", "1"], shift=100.0)])
    assert [tag for _, tag in shared.keys] == ["1", "2", "3", "4"]
    np.testing.assert_array_equal(shared.p[:, 0], [1, 2, 3, 4])
    np.testing.assert_array_equal(shared.b[1, :, 0], [101, np.nan, 103, 104])
    np.testing.assert_array_equal(shared.row, [[0, 1, 2, -1], [2, -1, 0, 1]])
    np.testing.assert_array_equal(shared.used, [[True, True, True, False], [True, False, True, True]])


def test_what_the_calibration_did_not_use_is_seen_but_not_used():
    table = _table(["1", "2"], used=[True, False], sigma=[0.1, np.nan])
    table.loc[0, "Xf"] = np.nan
    shared = side_by_side([table, table], sigma=0.5)
    assert not shared.used.any()
    assert shared.b[0, 1, 0] == 2
    assert np.isnan(shared.b_used).all()
    np.testing.assert_array_equal(shared.sigma, [0.1, 0.5])


def test_a_ball_in_two_clips_is_two_points():
    both = pd.concat([_table(["1"], clip="a"), _table(["1"], clip="b")])
    assert len(side_by_side([both]).p) == 2


def test_contradictions_are_refused():
    with pytest.raises(ValueError, match="tag 2 twice"):
        side_by_side([_table(["1", "2", "2"])])
    moved = _table(["1", "2"])
    moved["y"] = 0.5
    with pytest.raises(ValueError, match="differently"):
        side_by_side([_table(["1", "2"]), moved])
