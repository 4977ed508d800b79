"""Which views of a board are used, and which cameras they connect."""

import numpy as np

from tests.calibration.boards.test_board_fit import SIZE, views
from vidtrack.calibration.boards.board_corners import Seen
from vidtrack.calibration.boards.board_views import MOST_VIEWS, chosen_views, connected, corner_arrays


def table(b):
    seen = {("board", k): np.flatnonzero(np.isfinite(own).all(-1)) for k, own in enumerate(b)}
    return {view: Seen(ids, b[view[1], ids], np.full(len(ids), 0.1)) for view, ids in seen.items() if len(ids)}


def test_cameras_are_connected_by_views_that_both_see():
    b = np.full((4, 3, 8, 2), np.nan)
    b[0, 0] = b[1, 0] = b[1, 1] = b[2, 1] = b[3, 2] = 1.0
    assert connected(b) == [[0, 1, 2], [3]]
    b[2, 1, 5:] = np.nan  # five corners are no view
    assert connected(b) == [[0, 1], [2], [3]]


def test_of_many_views_the_most_different_are_used_and_the_rest_counted():
    b = views(3, 60)[0]
    chosen, left_out = chosen_views({"cam1": table(b)}, {"cam1": SIZE})
    assert len(chosen) == MOST_VIEWS
    assert left_out["cam1"]["like_others"] + left_out["cam1"]["blurred"] + len(chosen) >= 55
    again, sd = corner_arrays({"cam1": table(b)}, ["cam1"], chosen, b.shape[1])
    rows = [frame for _, frame in chosen]
    assert np.array_equal(again[0], b[rows], equal_nan=True)
    assert (sd[np.isfinite(again[..., 0])] == 0.1).all()


def test_a_camera_without_any_view_has_none_and_the_others_theirs():
    b = views(3, 10)[0]
    chosen, left_out = chosen_views({"cam1": table(b), "cam2": {}}, dict.fromkeys(("cam1", "cam2"), SIZE))
    assert chosen
    assert left_out["cam2"] == {"blurred": 0, "like_others": 0}
