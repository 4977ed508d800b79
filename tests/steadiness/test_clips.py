"""Clips of one calibration: a camera that was touched between two of them is named, with the clip and the size."""

import json

import numpy as np
import pytest

from tests.steadiness.scenes import F, Wall
from vidtrack.files.records import plain
from vidtrack.steadiness.clips import clip_findings, clip_movements, clips_from_record, covers


def pictures(thetas, balls=True):
    wall, rng = Wall(np.random.default_rng(21)), np.random.default_rng(22)
    shown, hung = {}, {}
    for name, theta in thetas.items():
        picture = wall.clean(theta) + rng.normal(0, 0.7, (240, 320))
        at = rng.uniform(30, 210, (6, 2)).round() if balls else np.empty((0, 2))
        for x, y in at.astype(int):
            picture[y - 4 : y + 5, x - 4 : x + 5] = 220
        shown[name], hung[name] = picture, np.column_stack([at, np.full(len(at), 5.0)])
    return shown, hung


def test_a_ball_covers_a_disc_of_as_many_pixels():
    discs = covers([[10.0, 20.0], [1.0, 2.0]], [np.pi * 25, 0])
    assert discs.tolist() == [[10.0, 20.0, pytest.approx(5.0)], [1.0, 2.0, 0.0]]


def test_clips_of_a_camera_at_rest_agree():
    moved = clip_movements(*pictures({"row1": (0,) * 4, "row2": (0,) * 4, "row3": (0,) * 4}))
    assert moved.patches > 6
    assert not clip_findings("cam1", moved)


def test_the_clip_before_which_the_camera_was_touched_is_named():
    theta = np.array([1.0, 0.8, 0, 0]) / F
    moved = clip_movements(*pictures({"row1": (0,) * 4, "row2": theta, "row3": (0,) * 4}))
    (found,) = clip_findings("cam1", moved)
    assert found.level == "bad"
    assert found.code == "camera-moved-between-clips"
    assert "cam1" in found.text
    assert "row2" in found.text
    assert "1.3" in found.text


def test_the_record_gives_the_movements_back_and_their_mean_by_points():
    wall = Wall(np.random.default_rng(21))
    theta = np.array([0.0, 4.0, 0, 0]) / F
    moved = clip_movements(*pictures({"a": (0,) * 4, "b": theta}, balls=False))
    again = clips_from_record(json.loads(json.dumps(plain(moved.as_record()))))
    mean, covariance = again.mean({"a": 10, "b": 30}, wall.law, wall.camera.image_size)
    assert F * mean == pytest.approx([0, 3, 0, 0], abs=0.1)
    assert 0 < F * np.sqrt(covariance[1, 1]) < 0.05
    assert not clips_from_record({}).mean({"a": 1}, wall.law, (320, 240))[0].any()
