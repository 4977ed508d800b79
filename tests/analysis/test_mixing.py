"""What a calibration's error mixes into motions, against a body whose targets are displaced and fitted again."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vidtrack.analysis.mixing import ErrorField, Resting, mixing, rigid_mixing
from vidtrack.analysis.motions import basin_axes, motions_at
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.motion.rigid import fit_pose

RNG = np.random.default_rng(5)
ARMS = np.array([[8.0, 0, 2], [-8, 0, 2], [-2, 5, 4], [-2, -5, 4]])
POINT = np.array([0.0, 0, 1])
BASIN = basin_axes("-y", "+z")


def field(n=3, bent=1e-4):
    H = RNG.normal(0, bent, (n, 3, 3, 3))
    return ErrorField(RNG.normal(0, 1e-3, (n, 3, 3)), (H + np.swapaxes(H, -1, -2)) / 2, np.array([3.0, -2, 1]))


def seen(error, shift, turn):
    """The six motions of the point that a fit to displaced targets gives, from rest to `shift` and `turn` (rad)."""
    origins, attitudes = [], []
    for s, R in ((np.zeros(3), np.eye(3)), (shift, Rotation.from_rotvec(turn).as_matrix())):
        targets = POINT + s + (ARMS - POINT) @ R.T
        pose = fit_pose(targets + error.at(targets)[0], ARMS)
        origins.append(pose.origin)
        attitudes.append(pose.R)
    rest = [True, False]
    found = motions_at(origins, attitudes, np.zeros((2, 6, 6)), POINT, BASIN, at_rest=rest)
    return found.motion[1]


@pytest.mark.parametrize("moved", range(6), ids=DEGREES_OF_FREEDOM)
def test_what_is_mixed_in_is_what_a_fit_to_displaced_targets_shows(moved):
    error = field(1)
    predicted = rigid_mixing(error, Resting(ARMS, POINT), BASIN)[0, :, moved]
    amount = 0.5  # world units or degrees
    step = amount * BASIN[moved % 3]
    ends = []
    for side in (1, -1):
        shift, turn = (side * step, np.zeros(3)) if moved < 3 else (np.zeros(3), side * np.radians(step))
        ends.append(seen(error, shift, turn))
    shown = (ends[0] - ends[1]) / (2 * amount)
    shown[moved] -= 1
    assert shown == pytest.approx(predicted, abs=0.02 * np.abs(predicted).max() + 1e-5)


def test_a_frame_that_is_turned_shows_pitch_as_yaw_and_no_strain():
    w = 1e-3
    turned = ErrorField(w * np.array([[[0.0, 0, 0], [0, 0, -1], [0, 1, 0]]]), np.zeros((1, 3, 3, 3)), np.zeros(3))
    M = rigid_mixing(turned, Resting(ARMS, POINT), basin_axes("+x", "+z"))[0]
    assert M[5, 4] == pytest.approx(w, rel=1e-6)
    assert M[2, 1] == pytest.approx(w, rel=1e-6)
    assert M[3, 3] == pytest.approx(0, abs=1e-9)


def test_a_field_that_bends_shows_surge_as_pitch():
    bent = np.zeros((1, 3, 3, 3))
    bent[0, 2, 0, 0] = 1e-4  # errors of z grow with the square of x
    M = rigid_mixing(ErrorField(np.zeros((1, 3, 3)), bent, np.zeros(3)), Resting(ARMS, POINT), basin_axes("+x", "+z"))
    assert abs(M[0, 4, 0]) == pytest.approx(np.degrees(1e-4), rel=0.1)
    straight = rigid_mixing(field(1, bent=0.0), Resting(ARMS, POINT), BASIN)
    assert straight[0, 3:, :3] == pytest.approx(0, abs=1e-9)


def test_targets_have_the_gradient_s_rows_and_unknown_names_none():
    error = field()
    found = mixing(["t1.y", "float.pitch", "float@CoG.surge", "eta"], error, BASIN, {"float": Resting(ARMS, POINT)})
    assert set(found) == {"t1.y", "float.pitch"}
    assert found["t1.y"][0] == ["t1.x", "t1.y", "t1.z"]
    assert found["t1.y"][1] == pytest.approx(error.gradients[:, 1])
    assert found["float.pitch"][0][4] == "float.pitch"
