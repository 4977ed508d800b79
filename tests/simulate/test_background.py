"""The pattern behind a simulated scene: it lies where a turned camera sees it, and moves nothing that stands near."""

import numpy as np
import pytest

from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.background import Texture, seen, turned
from vidtrack.simulate.rig import look_at

PLACE = np.array([0.0, -100.0, 30.0])
R = look_at(PLACE, (0, 0, 0))
OWN = Camera(79.5, 59.5, 1, 1, 1, 300.0, 1e-7, R, -R @ PLACE, (160, 120))


def test_a_camera_at_rest_sees_the_same_pattern_each_time_and_another_seed_another():
    one = seen(Texture(), OWN, OWN, 1)
    assert np.array_equal(one, seen(Texture(), OWN, OWN, 1))
    assert np.corrcoef(one.ravel(), seen(Texture(), OWN, OWN, 2).ravel())[0, 1] < 0.3
    assert one.std() == pytest.approx(12, rel=0.3)


def test_a_turn_moves_the_pattern_as_it_moves_a_far_point():
    after = turned(OWN, np.array([0.0, np.degrees(5 / 300), 0.0]))
    far = PLACE + 1e7 * OWN.R[2]
    shift = project(after, far) - project(OWN, far)
    assert abs(shift[0]) == pytest.approx(5, rel=0.02)
    a, b = seen(Texture(), OWN, OWN, 1), seen(Texture(), OWN, after, 1)
    step = round(float(shift[0]))
    same = np.roll(a, step, axis=1)[20:-20, 20:-20]
    assert np.abs(same - b[20:-20, 20:-20]).max() < 0.25 * np.abs(a).max()
    assert np.corrcoef(same.ravel(), b[20:-20, 20:-20].ravel())[0, 1] > 0.99


def test_zoom_grows_the_picture_about_the_principal_point():
    after = turned(OWN, np.zeros(3), 0.1)
    p = PLACE + 50 * OWN.R[2] + 10 * OWN.R[0]
    middle = np.array([OWN.Cx, OWN.Cy])
    assert project(after, p) - middle == pytest.approx(1.1 * (project(OWN, p) - middle), rel=0.02)


def test_a_pattern_may_fill_a_part_of_the_picture():
    shown = seen(Texture(cover=(0.0, 0.0, 0.5, 1.0)), OWN, OWN, 1)
    assert np.abs(shown[:, 90:]).max() < 1e-6
    assert shown[:, :70].std() > 5
