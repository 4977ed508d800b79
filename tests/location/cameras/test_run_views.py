"""The views of a run: tables whose balls are moved where the calibration is one of points."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import Calibrated
from vidtrack.geometry.ball_perspective import outline_offset
from vidtrack.location.cameras.run_views import run_views
from vidtrack.simulate.rig import thesis_rig

CAMERAS = thesis_rig(2)
N = 6


def table(pixels=900.0, tracklet=None):
    rows = {"time_s": np.arange(N) / 30, "target": "t1", "Xf": np.linspace(60, 90, N), "Yf": 70.0}
    rows |= {"sd_x": 0.01, "sd_y": 0.01, "flag": "", "timecode": ""}
    rows |= {} if pixels is None else {"pixels": pixels}
    return pd.DataFrame(rows | ({} if tracklet is None else {"tracklet": tracklet, "bound": False}))


def viewed(own, cameras, tracklets=None):
    tables = {"cam1": own, "cam2": own}
    return run_views(tables, tracklets or {}, cameras, {}, {}, "run")


def test_balls_are_moved_for_a_calibration_of_points_and_for_a_bare_camera():
    offset = outline_offset(CAMERAS[0], table()[["Xf", "Yf"]].to_numpy(), np.sqrt(900 / np.pi))
    records = {"describes": "points", "n_points": 40}
    for cameras in (
        {f"cam{i + 1}": (camera, None) for i, camera in enumerate(CAMERAS)},
        {f"cam{i + 1}": Calibrated(camera, None, records) for i, camera in enumerate(CAMERAS)},
    ):
        found = viewed(table(), cameras)
        np.testing.assert_allclose(found.views[0].b[0], table()[["Xf", "Yf"]].to_numpy() - offset)
        assert found.views[0].balls is not None
        assert found.balls["cam1"].describes == "points"
        assert found.balls["cam1"].largest_px == pytest.approx(np.hypot(*offset.T).max())


def test_flat_targets_are_not_moved_and_nothing_is_said_of_their_perspective():
    cameras = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(CAMERAS)}
    tables = dict.fromkeys(cameras, table())
    found = run_views(tables, {}, cameras, {}, {}, "run", flat=True)
    assert found.balls == {}
    for view in found.views:
        assert view.balls is None
        np.testing.assert_array_equal(view.b[0], table()[["Xf", "Yf"]].to_numpy())
        assert (view.sd > 0.03).all()


def test_a_calibration_of_an_older_version_is_one_of_outlines():
    cameras = {f"cam{i + 1}": Calibrated(camera, None, {"n_points": 40}) for i, camera in enumerate(CAMERAS)}
    found = viewed(table(), cameras)
    np.testing.assert_array_equal(found.views[0].b[0], table()[["Xf", "Yf"]].to_numpy())
    assert found.views[0].balls is None
    assert found.balls["cam1"].describes == "outlines"


def test_without_sizes_nothing_is_moved_and_nothing_said():
    cameras = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(CAMERAS)}
    found = viewed(table(pixels=None), cameras)
    np.testing.assert_array_equal(found.views[0].b[0], table()[["Xf", "Yf"]].to_numpy())
    assert found.balls == {}
    assert found.views[0].balls is None


def test_what_was_followed_besides_is_moved_alike():
    cameras = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(CAMERAS)}
    others = table(tracklet=3).assign(target="", Xf=np.linspace(60, 90, N))
    found = viewed(table(), cameras, {"cam1": others, "cam2": others})
    np.testing.assert_allclose(found.views[0].b[1], found.views[0].b[0])


def test_the_distance_of_a_calibration_through_water_is_kept():
    record = {"describes": "points", "perspective": {"distance": 42.0}}
    cameras = {f"cam{i + 1}": Calibrated(camera, None, record) for i, camera in enumerate(CAMERAS)}
    assert viewed(table(), cameras).views[1].balls.distance == 42.0


def test_one_camera_and_one_without_a_calibration_are_refused():
    with pytest.raises(VidtrackError, match="no calibration"):
        viewed(table(), {"cam1": (CAMERAS[0], None)})
    with pytest.raises(VidtrackError, match="two cameras"):
        run_views({"cam1": table()}, {}, {"cam1": (CAMERAS[0], None)}, {}, {}, "run")
