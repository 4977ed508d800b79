"""Boards as the stages give them: views, lenses, places, and what is said of a board that is not as described."""

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.calibration.boards.test_board_fit import BOARD, SIZE, cameras, views
from tests.stages.test_board_corners import frames
from vidtrack.calibration.adjustment.tied_cameras import moved_camera
from vidtrack.calibration.boards.board import Board
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import position_covariance
from vidtrack.simulate.board_picture import board_picture, drawing
from vidtrack.stages.board_corners import board_corners
from vidtrack.stages.boards import boards


def tables(b, sd=0.1):
    """The corners of `views`, a table a camera."""
    found = {}
    for i, own in enumerate(b):
        k, j = np.nonzero(np.isfinite(own).all(-1))
        columns = {"clip": "board", "frame": k, "corner": j, "Xf": own[k, j, 0], "Yf": own[k, j, 1], "sd": sd}
        found[f"cam{i + 1}"] = pd.DataFrame(columns)
    return found


def placed(b, board=BOARD, **how):
    found = tables(b)
    return boards(found, dict.fromkeys(found, SIZE), board, units="mm", model="tsai", **how)


def codes(found):
    return {finding.code for finding in found.findings}


def test_two_cameras_get_lens_and_place_in_the_world_that_is_named():
    found = placed(views(1, 16, m=2), world="board/3")
    truth = [camera.position for camera in cameras(2)]
    apart = np.linalg.norm(found.cameras["cam1"].position - found.cameras["cam2"].position)
    assert apart == pytest.approx(np.linalg.norm(truth[0] - truth[1]), rel=1e-3)
    assert found.record["world"] == "board/3"
    assert found.record["together"]
    world = found.sightings["cam1"][found.sightings["cam1"]["tag"].str.startswith("3-")]
    assert np.abs(world["z"]).max() < 0.1
    assert codes(found) == {"board-views"}


def test_a_world_that_no_camera_saw_is_one_line():
    with pytest.raises(VidtrackError, match=r"board/99.*board/0"):
        placed(views(1, 6), world="board/99")


def test_clips_that_were_not_filmed_together_are_named_and_each_lens_stands():
    b = views(1, 8, m=2)
    b[1] = np.roll(b[1], 3, axis=0)
    found = placed(b)
    assert "boards-not-simultaneous" in codes(found)
    assert found.cameras["cam2"].f == pytest.approx(1400, rel=5e-3)


def test_parallel_views_are_refused_with_the_camera():
    with pytest.raises(VidtrackError, match=r"cameras\.cam1: .*parallel"):
        placed(views(0, 8, tilt=0.0))


def test_blurred_views_are_left_out_and_counted():
    found = tables(views(1, 14))["cam1"]
    found.loc[found["frame"] == 4, "sd"] = 1.5
    done = boards({"cam1": found}, {"cam1": SIZE}, BOARD, model="tsai")
    assert done.record["left_out"]["cam1"]["blurred"] == 1
    assert "board/4" not in done.record["views"]


def test_a_camera_whose_board_is_not_found_is_named_and_the_others_go_on():
    found = tables(views(1, 14, m=2))
    found["cam3"] = found["cam1"].head(0)
    done = boards(found, dict.fromkeys(found, SIZE), BOARD, model="tsai", surveyed=["cam3"])
    assert set(done.cameras) == {"cam1", "cam2"}
    assert done.records["cam3"]["found"] is False
    (lost,) = [f for f in done.findings if f.code == "board-no-lens"]
    assert lost.level == "doubtful"
    assert "cam3" in lost.text
    assert len(done.sightings["cam3"]) == 0
    bare = boards(found, dict.fromkeys(found, SIZE), BOARD, model="tsai")
    assert [f.level for f in bare.findings if f.code == "board-no-lens"] == ["bad"]


def test_a_camera_without_surveyed_points_is_placed_among_those_that_see_them():
    """By six points that one of two cameras sees; the world is no longer the board's."""
    rng = np.random.default_rng(5)
    R, t = cv2.Rodrigues(np.array([0.3, 1.2, -0.4]))[0], np.array([500.0, -200.0, 90.0])
    true = [moved_camera(camera, R, t) for camera in cameras(2)]
    p = rng.uniform([-100, -80, 500], [200, 80, 900], (6, 3)) @ R.T + t
    sights = pd.DataFrame(np.hstack([p, project(true[0], p)]), columns=["x", "y", "z", "Xf", "Yf"])
    own = tables(views(1, 16, m=2))
    how = {"model": "tsai", "surveyed": ["cam1"]}
    done = boards(own, dict.fromkeys(own, SIZE), BOARD, survey={"cam1": sights}, **how)
    assert np.abs(done.cameras["cam2"].position - true[1].position).max() < 2.0
    seen = done.sightings["cam2"]
    again = project(done.cameras["cam2"], seen[["x", "y", "z"]].to_numpy(float))
    assert np.abs(again - seen[["Xf", "Yf"]].to_numpy(float)).max() < 1.0
    assert "boards-not-connected" not in codes(done)
    few = boards(own, dict.fromkeys(own, SIZE), BOARD, survey={"cam1": sights.head(3)}, **how)
    assert [f.level for f in few.findings if f.code == "boards-not-connected"] == ["bad"]


def test_cameras_that_share_no_view_are_bad_where_nothing_else_places_them():
    own = tables(views(1, 20, m=2))
    own["cam1"] = own["cam1"][own["cam1"]["frame"] < 10]
    own["cam2"] = own["cam2"][own["cam2"]["frame"] >= 10]

    def level(surveyed):
        done = boards(own, dict.fromkeys(own, SIZE), BOARD, model="tsai", surveyed=surveyed)
        assert not done.record["together"]
        return next(f.level for f in done.findings if f.code == "boards-not-connected")

    assert level([]) == "bad"
    assert level(["cam1", "cam2"]) == "note"
    assert level(["cam1"]) == "bad"


SMALL = (480, 360)


def pair():
    """Two cameras of small pictures, 23 degrees apart."""
    turns = [cv2.Rodrigues(np.array([0.0, 0.4 * i, 0.0]))[0] for i in range(2)]
    return [
        Camera(238.3 + i, 181.2, 1, 1, 1.0, 520.0, -0.05 / 520**2, R, np.array([-400.0 * i, 0, 80.0 * i]), SMALL)
        for i, R in enumerate(turns)
    ]


@pytest.mark.parametrize(
    ("kind", "columns", "rows"), [("checkerboard", 8, 6), ("checkerboard", 8, 5), ("circles", 7, 5)]
)
def test_boards_without_tags_give_two_cameras_their_lenses_and_places_from_pictures(kind, columns, rows):
    """Seven small pictures each, the board turned in its plane too, so that each camera has its own upper left corner.

    f within 0.5 %, centre within 3 px, the second camera within 0.5 % of its distance and 0.2 degrees; all errors
    within 4.5 of their sigma; held-out views are predicted to a tenth of a px.
    """
    rng, bitmap = np.random.default_rng(7), drawing(kind, columns, rows)
    board = Board(kind, columns, rows, 30.0)
    pictures = [[], []]
    for _ in range(7):
        tilted = cv2.Rodrigues(rng.normal(0, 0.4, 3) * [1, 1, 0])[0]
        R = tilted @ cv2.Rodrigues(np.array([0, 0, rng.uniform(0, 6.2)]))[0] @ np.diag([1.0, -1.0, -1.0])
        T = rng.uniform([20, -60, 520], [160, 60, 760]) - R @ [columns * 15.0, rows * 15.0, 0]
        for own, camera in zip(pictures, pair(), strict=True):
            own.append(board_picture(camera, R, T, bitmap, 30.0, rng=rng))
    found = {
        f"cam{i + 1}": board_corners({"b": frames(*own)}, {"b": board}, camera="c", bits={"b": 8}, every=1).table
        for i, own in enumerate(pictures)
    }
    done = boards(found, dict.fromkeys(found, SMALL), board, units="mm", model="tsai")
    assert done.record["together"], [f.text for f in done.findings]
    first, second = done.cameras.values()
    for got, true, name in zip((first, second), pair(), done.cameras, strict=True):
        u = done.uncertainties[name]
        sd = dict(zip(u.names, u.standard_errors.tolist(), strict=True))
        assert abs(got.f - true.f) < min(0.005 * true.f, 4.5 * sd["f"])
        assert abs(got.Cx - true.Cx) < min(3, 4.5 * sd["Cx"])
        assert abs(got.Cy - true.Cy) < min(3, 4.5 * sd["Cy"])
        assert 0 < done.records[name]["board"]["held_out_px"]["tsai"] < 0.1
    a, b = pair()
    turn = (second.R @ first.R.T) @ (b.R @ a.R.T).T
    assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) < 0.2
    place = first.R @ (second.position - first.position) - a.R @ (b.position - a.position)
    assert np.linalg.norm(place) < 0.005 * np.linalg.norm(b.position - a.position)


def test_cameras_are_within_their_sigma_where_the_world_is_a_board_seen_square_on():
    """Rendered: 0.03 mm off at 0.7 m. With corners that erred together, by 0.06 px a row, 0.9 mm, 2.6 to 3.8 sigma."""
    rng, bitmap, middle = np.random.default_rng(3), drawing("charuco", 8, 6), np.array([120.0, 90.0, 0.0])
    pictures, board = [[], []], Board("charuco", 8, 6, 30.0)
    for k in range(9):
        R = cv2.Rodrigues(rng.normal(0, 0.35, 3) if k else np.zeros(3))[0] @ np.diag([1.0, -1.0, -1.0])
        T = (rng.uniform([-40, -80, 560], [240, 80, 850]) if k else [100.0, 0.0, 700.0]) - R @ middle
        world = (R, T) if k == 0 else world  # noqa: F821
        for own, camera in zip(pictures, pair(), strict=True):
            own.append(board_picture(camera, R, T, bitmap, 30.0, rng=rng))
    found = {
        f"cam{i + 1}": board_corners({"b": frames(*own)}, {"b": board}, camera="c", bits={"b": 8}, every=1).table
        for i, own in enumerate(pictures)
    }
    done = boards(found, dict.fromkeys(found, SMALL), board, world="b/0", units="mm", model="tsai")
    for name, camera in zip(done.cameras, pair(), strict=True):
        true = camera.with_(R=camera.R @ world[0], T=camera.R @ world[1] + camera.T)
        u = done.uncertainties[name]
        C = position_covariance(done.cameras[name], u.names, u.pivot, u.covariance)
        off = done.cameras[name].position - true.position
        assert np.abs(off).max() < 0.25
        assert (np.abs(off) < 2.5 * np.sqrt(np.diag(C))).all()


def test_a_symmetric_board_of_which_cameras_share_one_view_is_one_clear_line():
    b = views(1, 16, m=2)
    own = tables(b[:, :, [8 * j + i for j in range(5) for i in range(7)]])  # as a checkerboard of 8 x 6 has them
    own["cam2"].loc[own["cam2"]["frame"] != 4, "frame"] += 100
    alike = Board("checkerboard", 8, 6, 30.0)
    done = boards(own, dict.fromkeys(own, SIZE), alike, model="tsai")
    (finding,) = [f for f in done.findings if f.code == "board-orientation"]
    assert finding.level == "bad"
    assert "cam1, cam2 fit together either way" in finding.text
    assert "ChArUco" in finding.cure
    assert not done.record["together"]
