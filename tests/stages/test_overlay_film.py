"""What is drawn over a recording: marks at the frame, and points projected back at its moment."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.camera import Camera, project
from vidtrack.stages.overlay_film import names_of_tracks, overlay_marks, targets_of
from vidtrack.timing.clock import Clock

CAMERA = Camera(320, 240, 0.01, 0.01, 1.0, 8.0, 1e-3, np.eye(3), np.array([0.0, 0.0, 10.0]), (640, 480))


def centroids(n=4, lost=(2,)):
    frames = np.arange(n)
    X = np.where(np.isin(frames, lost), np.nan, 100.0 + frames)
    box = {"box_x": 80.0, "box_y": 60.0, "box_w": 50.0, "box_h": 40.0}
    flag = np.where(np.isin(frames, lost), "lost", "")
    columns = {"frame": frames, "field": "frame", "time_s": 10 + frames / 25, "target": "a", "Xf": X, "Yf": X / 2}
    return pd.DataFrame({**columns, **box, "flag": flag})


def path(t):
    return np.column_stack([0.1 * (t - 10), 0.2 * (t - 10), np.zeros_like(t)])


def trajectories(t, gaps=()):
    p = path(t)
    p[list(gaps)] = np.nan
    return pd.DataFrame({"time_s": t, "target": "ball", **dict(zip("xyz", p.T, strict=True)), "flag": ""})


def test_a_seen_sample_is_marked_at_its_centroid_and_a_lost_one_in_its_box():
    marks = overlay_marks(centroids())
    assert marks[1] == [("a", "seen", (101.0, 50.5), (80.0, 60.0, 50.0, 40.0), "")]
    assert marks[2][0].kind == "lost"
    assert marks[2][0].at == (105.0, 80.0)
    assert targets_of(marks) == ["a"]


def test_the_located_point_is_projected_at_the_corrected_moment_of_the_frame():
    t = np.linspace(10, 10.4, 41)
    marks = overlay_marks(centroids(), trajectories(t), CAMERA, clock=Clock(0.05, 0.0), shift_s=0.02)
    for frame in range(4):
        (mark,) = [m for m in marks[frame] if m.kind == "located"]
        assert mark.target == "ball"
        assert mark.at == pytest.approx(project(CAMERA, path(np.array([10 + frame / 25 + 0.07])))[0], abs=1e-3)


def test_no_point_is_projected_into_a_gap_or_beyond_the_ends():
    t = np.arange(10.02, 10.1, 0.01)  # begins after frame 0, ends before frame 3
    marks = overlay_marks(centroids(), trajectories(t, gaps=(1, 2, 3)), CAMERA)
    located = [frame for frame in marks if any(m.kind == "located" for m in marks[frame])]
    assert located == [2]  # frame 1, at 10.04, lies in the gap


def test_a_plane_run_has_marks_without_located_points():
    marks = overlay_marks(centroids(), trajectories(np.linspace(10, 11, 9)), None)
    assert {m.kind for own in marks.values() for m in own} == {"seen", "lost"}


def test_tracks_take_the_names_of_their_targets():
    record = {"correspondence": {"targets": {"bow": {"tracks": {"cam1": ["t2"], "cam2": ["t1"]}}}}}
    assert names_of_tracks(record, "cam1") == {"t2": "bow"}
    assert names_of_tracks({}, "cam1") == {}
