"""A camera that moved is caught, with honest error bars; one that stood still is left in peace."""

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.movement import movement
from vidtrack.geometry.camera import project
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.simulate.rig import look_at, thesis_points, thesis_rig

SIGMA = 1 / 32 / np.sqrt(3)


def _sights(camera, rng, noise=0.1):
    p = thesis_points()[1]
    return p, project(camera, p + rng.uniform(-1, 1, p.shape) / 32) + rng.normal(0, noise, (64, 2))


def _turned(camera, omega_deg):
    R = rotation_from_vector(np.radians(omega_deg)) @ camera.R
    return camera.with_(R=R, T=-R @ camera.position)


def _calibrated(camera, sights):
    return refine(camera, *sights, free=free_parameters("tsai"), sd=0.1, survey=SIGMA).camera


def test_a_camera_that_sags_is_found_to_tilt_down():
    rng = np.random.default_rng(0)
    camera = thesis_rig()[0]
    sagged = camera.position, camera.position + camera.R.T @ [0, 0.0, 100], camera.R[1]
    lower = sagged[1] + 0.2 * sagged[2]  # aims 0.2 in lower at 100 in: 0.115 degrees
    R = look_at(camera.position, lower, up=-sagged[2])
    before = _sights(camera, rng)
    found = movement(
        _calibrated(camera, before),
        before,
        _sights(camera.with_(R=R, T=-R @ camera.position), rng),
        survey=(SIGMA, SIGMA),
    )
    assert found.probability < 1e-6
    assert found.turn_in_place[0] == pytest.approx(np.degrees(0.002), abs=4 * found.turn_in_place_sd[0])
    assert found.turn_in_place_sd[0] < 0.005
    assert found.chi2_in_place < 16.3
    assert found.picture_shift.mean() == pytest.approx(1.6, abs=0.2)  # 0.002 rad of f/dy = 796 px


@pytest.mark.parametrize(("axis", "sign"), [(1, -1), (2, -1)])
def test_pan_and_roll_have_the_sense_that_their_names_say(axis, sign):
    camera = thesis_rig()[0]
    before = thesis_points()[1], project(camera, thesis_points()[1])
    omega = np.zeros(3)
    omega[axis] = sign * 0.3  # points turn left when the camera pans right, and against the clock when it rolls with it
    found = movement(camera, before, (before[0], project(_turned(camera, omega), before[0])))
    assert found.turn[axis] == pytest.approx(0.3, abs=1e-6)
    assert found.turn_in_place[axis] == pytest.approx(0.3, abs=1e-4)  # to first order in the angle


def test_a_shift_is_found_as_a_shift():
    camera, p = thesis_rig()[1], thesis_points()[1]
    moved = camera.with_(T=camera.T - camera.R @ (0.5, -1.0, 0.25))
    found = movement(camera, (p, project(camera, p)), (p[::2], project(moved, p[::2])), sd=0.1)
    np.testing.assert_allclose(found.shift, (0.5, -1.0, 0.25), atol=1e-6)
    np.testing.assert_allclose(found.turn, 0, atol=1e-6)
    assert found.chi2_in_place > 16.3


def test_a_camera_at_rest_has_the_chi_squared_of_six_numbers():
    """Variance 1 each, from below as well as above, although the lens itself is known with error."""
    rng = np.random.default_rng(3)
    camera = thesis_rig()[0]
    chi2, normalised = [], []
    for _ in range(30):
        before, after = _sights(camera, rng), _sights(camera, rng)
        found = movement(_calibrated(camera, before), before, after, sd=0.1, survey=(SIGMA, SIGMA))
        chi2.append(found.chi2)
        normalised += [*(found.shift / found.shift_sd), *(found.turn / found.turn_sd)]
    assert 4 < np.mean(chi2) < 8  # standard error .6
    assert 0.6 < np.mean(np.square(normalised)) < 1.5
    assert min(chi2) < 5 < max(chi2)


def test_too_few_points_are_refused():
    camera, p = thesis_rig()[0], thesis_points()[1]
    with pytest.raises(ValueError, match="3 points"):
        movement(camera, (p, project(camera, p)), (p[:3], project(camera, p[:3])))


def test_a_camera_behind_a_window_that_sags_is_found_too():
    window = Interface(
        "w", np.array([0, 0, 30.0]), np.array([0, 0.2, 1]), (1, 1.49, 1.333), (1.0,), (1, 0.1, 0.1, 0, 0, 0)
    )
    camera = thesis_rig(1)[0].with_(through=(window,))
    rng = np.random.default_rng(0)
    found = movement(camera, _sights(camera, rng), _sights(_turned(camera, [0.2, 0, 0]), rng), sd=0.1)
    assert found.turn.shape == (3,)
    assert abs(abs(found.turn[0]) - 0.2) < 5 * found.turn_sd[0]
    assert found.probability < 1e-6
