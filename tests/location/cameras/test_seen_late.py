"""Positions that all cameras show late by the same: their sigma holds it, along the way of the target."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.cameras.seen_late import with_lateness
from vidtrack.simulate.rig import thesis_rig

AT = np.arange(200) / 30.0
SD = 0.02


def course(t):
    return np.stack([12 * np.sin(3 * t), 4 * np.cos(2 * t), np.zeros_like(t)], -1)[None]


def located(late=0.0, lost=()):
    cameras = thesis_rig(3)
    b = np.stack([project(camera, course(AT - late)) for camera in cameras])
    b += np.random.default_rng(1).normal(0, SD, b.shape)
    b[:, :, list(lost)] = np.nan
    return locate_points(cameras, b, sd=np.full(b.shape, SD))


def test_nothing_changes_where_no_camera_is_late():
    plain = located()
    same, added = with_lateness(plain, AT, 0.0)
    assert same is plain
    assert not added.any()


@pytest.mark.parametrize("late", [0.5 / 30, 2 / 30])
def test_what_is_late_is_within_three_sigma_and_the_residuals_say_nothing_of_it(late):
    plain = located(late)
    off = np.abs(plain.point - course(AT))
    assert (off > 5 * plain.sigma).any(-1).mean() > 0.7
    held, added = with_lateness(plain, AT, late)
    assert (off < 3 * held.sigma + 3 * plain.sigma).all()
    assert np.median(held.sigma[0, :, 0]) < 1.5 * np.median(off[0, :, 0])
    assert (held.sigma[..., 2] < 5 * plain.sigma[..., 2]).mean() > 0.9  # it does not go that way
    np.testing.assert_allclose(held.covariance, plain.covariance + added)


def test_beside_a_gap_the_velocity_is_that_of_the_nearest_step():
    lost = (50, 51, 53)  # 52 has no neighbour
    held, _ = with_lateness(located(lost=lost), AT, 1 / 30)
    assert np.isnan(held.sigma[0, list(lost)]).all()
    v, a = 36 * np.cos(3 * AT), -108 * np.sin(3 * AT)
    step = 36 * np.cos(3 * (AT[48] + AT[49]) / 2)
    assert held.sigma[0, 49, 0] == pytest.approx(np.hypot(step / 30, np.sqrt(np.mean(a**2)) / 1800), rel=0.15)
    assert held.sigma[0, 52, 0] == pytest.approx(np.sqrt(np.mean(v**2)) / 30, rel=0.15)
