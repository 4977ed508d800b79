"""What each film shows, from which label on, and how a camera that was knocked stands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.simulate.test_laboratory import LAB
from vidtrack.geometry.camera import project
from vidtrack.simulate.films import clips, moved, recordings
from vidtrack.simulate.rig import thesis_rig
from vidtrack.simulate.scenario import scenario_from
from vidtrack.video.reader import open_video

CAMERA = thesis_rig(1)[0]
small = st.floats(-5, 5)


@given(st.tuples(small, small, small), st.tuples(small, small, small))
def test_a_camera_that_was_moved_stands_there_turned_about_its_own_axes(shift, turn):
    camera = moved(CAMERA, (shift, turn))
    np.testing.assert_allclose(camera.position, CAMERA.position + shift, atol=1e-9)
    own = Rotation.from_rotvec(turn, degrees=True).as_matrix()
    np.testing.assert_allclose(camera.R, own.T @ CAMERA.R, atol=1e-12)


def test_a_camera_that_was_not_moved_is_the_same():
    assert moved(CAMERA, None) is CAMERA


def test_every_camera_films_every_clip_and_run():
    scenario = scenario_from(LAB)
    assert [path for path, _ in clips(scenario)] == [
        f"calibration/{clip}/{camera}.mov" for clip in ("front", "rear") for camera in ("left", "right")
    ]
    assert [path for path, _ in recordings(scenario)] == ["runs/swing/left.mov", "runs/swing/right.mov"]


@pytest.mark.slow
def test_a_clip_shows_its_balls_where_the_camera_sees_them(tmp_path):
    scenario = scenario_from(LAB)
    path, write = next(iter(clips(scenario)))
    write(str(tmp_path / "clip.mov"))
    with open_video(str(tmp_path / "clip.mov")) as video:
        frames = [frame.luma.astype(float) for frame in video.frames()]
    assert len(frames) == LAB["calibration"]["frames"]
    tags, places = scenario.points()
    picture = scenario.picture_of("left")
    for tag in "12345678":
        x, y = project(scenario.camera("left"), places[tags.index(tag)]).round().astype(int)
        shown = frames[0][y, x] > picture.background + picture.contrast / 2
        assert shown == (tag in "1234"), path
