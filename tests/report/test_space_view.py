"""The view in space has the cameras where they are, the survey and its hull, and targets where they were located."""

import itertools
import json

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.camera import Camera, project
from vidtrack.report.space_view import as_json, space_view
from vidtrack.results import CameraResults, Results

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
R = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
TSAI = {"Cx": 255.5, "Cy": 239.5, "dx": 0.02, "dy": 0.02, "Sx": 1.0, "f": 10.0, "kappa1": 1e-4}


def results(points=CUBE):
    rows = pd.DataFrame(points, columns=["x", "y", "z"]).assign(tag=[str(i) for i in range(len(points))])
    record = {**TSAI, "R": R.tolist(), "T": [0.0, 0.0, 9.0], "image_size": [512, 480]}
    twice = pd.concat([rows, rows], ignore_index=True)  # points that were seen in two clips
    return Results(cameras={"cam1": CameraResults(record=record, points=twice)})


def trajectories():
    t = np.arange(3) + 36000.25
    rows = pd.DataFrame({"time_s": t, "target": "t1", "x": [0.0, np.nan, 0.2], "y": 0.0, "z": 0.1})
    return rows.assign(sigma_x=0.001, sigma_y=0.002, sigma_z=0.003)


def test_a_camera_stands_at_its_centre_and_its_view_projects_onto_the_corners_of_the_picture():
    view = space_view(results(), None, {"cam1": "red"}, "m")
    (camera,) = view["cameras"]
    assert (camera["name"], camera["colour"]) == ("cam1", "red")
    assert camera["centre"] == pytest.approx([0, -9, 0])
    bare = Camera(**TSAI | {"kappa1": 0.0}, R=R, T=np.array([0, 0, 9.0]), image_size=(512, 480))
    seen = project(bare, np.array(camera["corners"]))
    assert seen == pytest.approx(np.array([[0, 0], [511, 0], [511, 479], [0, 479]]), abs=0.01)
    assert (R @ np.array(camera["corners"]).T)[2] + 9 == pytest.approx([3.0] * 4, abs=1e-4)


def test_the_hull_of_a_cube_is_its_twelve_edges():
    view = space_view(results(), None, {}, "m")
    assert len(view["points"]) == 8
    points = np.array(view["points"])
    lengths = [float(np.linalg.norm(points[i] - points[j])) for i, j in view["hull"]]
    assert lengths == pytest.approx([2.0] * 12)


def test_points_in_a_plane_span_no_volume():
    assert space_view(results(CUBE[:4]), None, {}, "m")["hull"] == []


def test_targets_are_where_they_were_located_with_their_sigmas_and_not_where_they_were_lost():
    view = json.loads(as_json(space_view(results(), trajectories(), {}, "m")))
    (track,) = view["tracks"]
    assert track["p"] == [[0, 0, 0.1], None, [0.2, 0, 0.1]]
    assert track["s"][0] == [0.001, 0.002, 0.003]
    assert view["t0"] + np.array(view["times"]) == pytest.approx(36000.25 + np.arange(3))
    assert view["magnified"] >= 1
