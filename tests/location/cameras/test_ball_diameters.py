"""One diameter a ball serves all its samples in all cameras."""

import numpy as np
import pytest

from vidtrack.geometry.ball_perspective import SHARE, outline_offset
from vidtrack.geometry.camera import project
from vidtrack.location.cameras.ball_diameters import diameters, px_across, resized
from vidtrack.location.cameras.ball_sizes import px_per_unit
from vidtrack.simulate.rig import thesis_rig

CAMERAS = thesis_rig(3)
D = 16.0
T = np.arange(60)
P = np.stack([5 * np.cos(T / 9), 5 * np.sin(T / 9), 2 * np.sin(T / 7)], -1)[None]
"""A ball that comes nearer and goes away, in."""


def seen():
    """b, sd (3, 1, 60, 2) and ball (3, 1, 60, 3), as views have them, and where the middle is."""
    true = np.stack([project(c, P) for c in CAMERAS])
    radius = np.stack([D / 2 * px_across(c, P) for c in CAMERAS])
    off = np.stack([outline_offset(c, b, r) for c, b, r in zip(CAMERAS, true, radius, strict=True)])
    return true, off, radius


def test_a_ball_looks_as_wide_as_the_jacobian_of_the_camera_says():
    for camera in CAMERAS:
        np.testing.assert_allclose(px_across(camera, P[0]), px_per_unit(camera, P[0]), rtol=1e-4)


def test_the_diameter_is_that_of_most_samples_of_most_cameras():
    _, _, radius = seen()
    assert diameters(CAMERAS, P, radius) == pytest.approx([D], rel=1e-6)
    radius[0] *= 1.3
    radius[1:, :, 40:] *= 1.2
    radius[2, :, ::7] = np.nan
    assert diameters(CAMERAS, P, radius) == pytest.approx([D], rel=1e-3)
    assert np.isnan(diameters(CAMERAS, np.full(P.shape, np.nan), radius)).all()


def test_what_was_taken_off_by_a_wrong_radius_is_put_right_and_no_noise():
    true, off, radius = seen()
    wrong = np.ones(radius.shape)
    wrong[:, :, 40:] = 1.25
    ball = np.concatenate([off * wrong[..., None] ** 2, (radius * wrong)[..., None]], axis=-1)
    sd = np.hypot(0.02, SHARE * ball[..., :2])
    b = true + off - ball[..., :2]
    assert np.abs(b - true).max() > 0.02
    own = resized(CAMERAS, b, sd, ball, P)
    assert np.abs(own.b - true).max() < 0.05 * np.abs(b - true).max()
    np.testing.assert_allclose(own.sd, 0.02)
    np.testing.assert_allclose(own.lasting, SHARE * np.abs(off), rtol=1e-3)


def test_where_it_is_not_known_where_a_ball_is_it_stays_as_it_was_taken():
    true, off, radius = seen()
    ball = np.concatenate([off, radius[..., None]], axis=-1)
    nowhere = np.full(P.shape, np.nan)
    own = resized(CAMERAS, true, np.hypot(0.02, SHARE * off), ball, nowhere)
    np.testing.assert_allclose(own.b, true)
    none = resized(CAMERAS, true, np.full(true.shape, 0.02), None, P)
    assert none.b is true
    assert not none.lasting.any()
    unmoved = resized(CAMERAS, true, np.full(true.shape, 0.02), np.full(ball.shape, np.nan), P)
    np.testing.assert_allclose(unmoved.b, true)
    np.testing.assert_allclose(unmoved.sd, 0.02)
