"""A zoom of all lenses at which the sizes of the targets hint is held in sigma."""

from dataclasses import replace

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.cameras.zoom_in_sigma import hinted_zoom, with_zoom
from vidtrack.simulate.rig import thesis_rig

SD = 0.02
AT = np.arange(60) / 30.0
COURSE = np.stack([12 * np.sin(3 * AT), 4 * np.cos(2 * AT), 3 * np.sin(AT)], -1)[None]


def sizes(*larger, sd=0.002, **more):
    """Of each camera how much larger it sees a target, a logarithm."""
    targets = ({"t1": {"n": 60, "larger": own, "sd": sd, "wander": 0.0}} for own in larger)
    return {f"cam{k}": {"balls": 36, "scatter": 0.001, **more, "targets": own} for k, own in enumerate(targets)}


def located(zoom=0.0):
    """What cameras calibrated at f locate while their lenses are at f exp(zoom)."""
    cameras = thesis_rig(3)
    b = np.stack([project(replace(camera, f=camera.f * np.exp(zoom)), COURSE) for camera in cameras])
    b += np.random.default_rng(1).normal(0, SD, b.shape)
    sd = np.full(b.shape, SD)
    return cameras, b, sd, locate_points(cameras, b, sd=sd)


@pytest.mark.parametrize(
    ("larger", "outlines", "hinted"),
    [
        ((0.0008, 0.0010, 0.0009), False, False),  # within its sd
        ((0.006, 0.005, 0.0055), False, True),
        ((-0.006, -0.005, -0.0055), True, True),
        ((0.009, 0.002, 0.006), True, True),
        ((0.016, 0.001, 0.001), True, False),  # one camera alone
        ((0.05, 0.05, 0.05), False, False),  # other balls
        ((), False, False),
    ],
)
def test_a_zoom_is_hinted_at_beyond_some_standard_deviations(larger, outlines, hinted):
    zoom = hinted_zoom(sizes(*larger, **({"lasting": 0.001} if outlines else {})))
    assert bool(zoom) is hinted
    if hinted:
        assert zoom == pytest.approx(np.mean(larger), rel=0.1)


def test_positions_of_zoomed_lenses_are_within_sigma_where_sizes_hint_at_it():
    cameras, b, sd, plain = located(zoom=0.006)
    off = np.abs(plain.point - COURSE)
    assert (off > 5 * plain.sigma).any(-1).mean() > 0.5
    assert np.abs(plain.error).max() < 1.0  # lines of sight meet all the same
    held = with_zoom(plain, cameras, b, sd, sizes(0.0055, 0.006, 0.0065), "runs.a")
    np.testing.assert_allclose(held.located.covariance, plain.covariance + held.added)
    assert (off < 1.5 * held.located.sigma + 4 * plain.sigma).all()
    assert (held.located.point == plain.point).all()
    (note,) = held.findings
    assert (note.level, note.code) == ("note", "zoom-in-sigma")
    assert note.text.startswith("runs.a: the targets look 0.60% larger than the balls of the calibration")


def test_cameras_that_were_left_out_and_samples_without_a_fix_take_no_part():
    cameras, b, sd, plain = located()
    b[0, 0, 5] += 400.0
    b[1:, 0, 9] = np.nan
    plain = locate_points(cameras, b, sd=sd, reject=3.0)
    held = with_zoom(plain, cameras, b, sd, sizes(0.006, 0.006, 0.006), "runs.a")
    assert plain.left_out[0, 0, 5]
    assert held.located.sigma[0, 5] == pytest.approx(held.located.sigma[0, 4], rel=0.5)
    assert np.isnan(held.located.sigma[0, 9]).all()


def test_nothing_changes_where_sizes_hint_at_nothing():
    cameras, b, sd, plain = located()
    same = with_zoom(plain, cameras, b, sd, {}, "runs.a")
    assert same.located is plain
    assert (same.added, same.findings) == (None, [])
