import numpy as np
import pytest

from tests.calibration.camera.test_plane_camera import looking
from tests.shore.rendered_beach import ENDS, shore
from vidtrack.geometry.camera import project
from vidtrack.geometry.interface import Interface
from vidtrack.shore.transect import along_transect_sd, sampling_map, transect

CAMERA = shore(frames=1).camera
ARGUMENTS = (CAMERA, ENDS["from"], ENDS["to"])


def test_samples_lie_a_pixel_apart_on_the_ground_s_line():
    line = transect(*ARGUMENTS)
    gaps = np.linalg.norm(np.diff(line.b, axis=0), axis=1)
    assert gaps == pytest.approx(np.ones(len(gaps)), abs=0.03)
    assert line.p[:, 2] == pytest.approx(0.1 * line.p[:, 0])
    assert project(CAMERA, line.p) == pytest.approx(line.b)
    assert np.diff(line.s) == pytest.approx(np.linalg.norm(np.diff(line.p, axis=0), axis=1))


def test_a_step_on_the_ground_is_kept():
    assert np.diff(transect(*ARGUMENTS, step=0.05).s) == pytest.approx(np.full(190, 0.05), abs=1e-9)


def test_a_profile_bends_the_ground():
    profile = [[10, 0, 2.0], [0.5, 0, 0], [6, 0, 0.4]]
    line = transect(*ARGUMENTS, profile=profile)
    assert line.p[:, 2] == pytest.approx(np.interp(line.p[:, 0], [0.5, 6, 10], [0, 0.4, 2]), abs=1e-6)


def test_a_profile_that_ends_halfway_is_refused():
    with pytest.raises(ValueError, match="covers 0 to 47 %"):
        transect(*ARGUMENTS, profile=[[0.5, 0, 0], [5, 0, 0.5]])


def test_what_lies_outside_the_picture_is_left_out():
    line = transect(CAMERA, [0.5, 0, 0.05], [40, 0, 4])
    assert line.p[-1, 0] < 30
    assert (line.b > 1).all()
    assert (line.b < [318, 238]).all()


def test_a_transect_that_nobody_sees_is_refused():
    with pytest.raises(ValueError, match="does not see any"):
        transect(CAMERA, [-50, 0, 0], [-40, 0, 1])
    with pytest.raises(ValueError, match="only 2 samples"):
        transect(CAMERA, [5, 0, 0.5], [5.05, 0, 0.505])
    with pytest.raises(ValueError, match="same point"):
        transect(CAMERA, [5, 0, 0.5], [5, 0, 0.5])


def test_a_wall_may_stand_upright():
    line = transect(CAMERA, [5, 0, 0], [5, 0, 3])
    assert line.s[-1] == pytest.approx(3, abs=0.01)


def test_the_map_reads_across_the_transect():
    line = transect(*ARGUMENTS)
    mx, my = sampling_map(line, across=3)
    assert mx[:, 1] == pytest.approx(line.b[:, 0], abs=1e-3)
    assert np.hypot(mx[:, 2] - mx[:, 0], my[:, 2] - my[:, 0]) == pytest.approx(np.full(len(mx), 2), abs=1e-3)
    assert (
        np.abs(
            (mx[:, 2] - mx[:, 0]) * np.gradient(line.b[:, 0]) + (my[:, 2] - my[:, 0]) * np.gradient(line.b[:, 1])
        ).max()
        < 1e-3
    )


def test_only_errors_along_the_transect_move_the_edge():
    line = transect(*ARGUMENTS)
    tangent = np.gradient(line.b, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.stack([-tangent[:, 1], tangent[:, 0]], -1)
    along_only, across_only = (v[:, :, None] * v[:, None, :] for v in (tangent, across))
    assert along_transect_sd(line, across_only).max() < 1e-6
    metres_a_px = np.gradient(line.s)
    assert along_transect_sd(line, along_only) == pytest.approx(metres_a_px, rel=0.05)


def test_a_transect_behind_a_flumes_glass_wall_is_sampled_where_bent_light_shows_it():
    """Refraction moves a beach 300 mm behind 20 mm of glass by many px; the camera's own projection is what counts."""
    wall = Interface("wall", np.array([0.0, 0, 300]), np.array([0.0, 0, -1]), (1.0, 1.52, 1.333), (20.0,))
    wet, dry = looking((350, -150, 1100), through=(wall,)), looking((350, -150, 1100), through=())
    ends = ([-200.0, 40, 0], [200.0, 90, 0])
    line = transect(wet, *ends, step=2.0)
    np.testing.assert_allclose(line.b, project(wet, line.p), atol=1e-9)
    assert np.linalg.norm(line.b - project(dry, line.p), axis=-1).min() > 5
