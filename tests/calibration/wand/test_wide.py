"""Pictures of wide lenses are straightened as a perspective camera would see them, and place a camera."""

import numpy as np
import pytest

from vidtrack.calibration.wand.wide import resected, straightened_px
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig

PLAIN = thesis_rig()[0].without_lens()
WIDE = PLAIN.with_(projection="equidistant", f=PLAIN.image_size[0] * PLAIN.dx / np.radians(120.0))


def surroundings(n, seed=0):
    """Points (n, 3) that fill the wide lens's picture."""
    rng = np.random.default_rng(seed)
    angle, turn, far = (
        np.radians(55) * np.sqrt(rng.uniform(0, 1, n)),
        rng.uniform(0, 2 * np.pi, n),
        rng.uniform(40, 90, n),
    )
    seen = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=-1)
    return (far[:, None] * seen - WIDE.T) @ WIDE.R


def test_a_straightened_picture_is_that_of_a_perspective_camera_with_square_pixels():
    p = surroundings(50)
    perspective = WIDE.with_(projection="perspective", Cx=0.0, Cy=0.0, dy=WIDE.dx, Sx=1.0)
    flat = straightened_px(project(WIDE.with_(Sx=1.0), p), WIDE, WIDE.f)
    assert flat == pytest.approx(project(perspective, p), abs=1e-6)


def test_what_lies_beyond_a_right_angle_has_no_place_in_a_straightened_picture():
    rim = np.array([[WIDE.Cx + 1.5 * WIDE.f / WIDE.dx, WIDE.Cy]])
    assert np.isnan(straightened_px(rim, WIDE, WIDE.f)).all()


def test_points_place_a_wide_camera_of_unknown_focal_length():
    p = surroundings(80, seed=1)
    true = WIDE.with_(Sx=1.0)
    b = project(true, p) + np.random.default_rng(2).normal(0, 0.1, (80, 2))
    found = resected(p, b, true.with_(f=1.3 * true.f), np.random.default_rng(3))
    assert found is not None
    assert np.sqrt(((project(found, p) - project(true, p)) ** 2).mean()) < 0.1
    assert found.f == pytest.approx(true.f, rel=0.01)
