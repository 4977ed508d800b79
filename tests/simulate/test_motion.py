"""Targets go where the formula says."""

import numpy as np
import pytest

from vidtrack.simulate.motion import Motion, Oscillation, Turn, attitude, position, swing


def test_a_pluck_is_held_until_its_release_and_then_swings_with_its_period():
    term = Oscillation(amplitude=24, hz=0.5, release_s=1.0)
    assert swing(term, [0.0, 0.9, 1.0, 2.0, 3.0]) == pytest.approx([24, 24, 24, -24, 24])


def test_its_amplitude_falls_to_one_over_e_in_the_time_of_its_decay():
    term = Oscillation(amplitude=10, hz=1, decay=0.5)
    assert swing(term, 2.0) == pytest.approx(10 / np.e)


def test_a_vibration_that_the_release_sets_off_begins_at_rest():
    term = Oscillation(amplitude=0.7, hz=4, phase_deg=-90, release_s=1)
    assert swing(term, [0.0, 1.0]) == pytest.approx([0, 0])
    assert swing(term, 1 + 1 / 16) == pytest.approx(0.7)


def test_the_direction_is_a_unit_vector_whatever_its_length():
    motion = Motion(at=(1, 2, 3), oscillations=(Oscillation(along=(0, 5, 0), amplitude=2, hz=1),))
    assert position(motion, 0.0) == pytest.approx([1, 4, 3])


def test_travel_and_a_path_add_up():
    motion = Motion(velocity=(1, 0, 0), path=((0, 0, 0, 0), (2, 0, 4, 0)))
    assert position(motion, [1.0, 3.0]) == pytest.approx(np.array([[1, 2, 0], [3, 4, 0]]))


def test_an_arm_turns_about_its_place_by_the_right_hand():
    quarter = Turn(about=(0, 0, 1), amplitude_deg=90, hz=0)
    motion = Motion(at=(10, 0, 0), arm=(2, 0, 0), turns=(quarter,))
    assert position(motion, 0.0) == pytest.approx([10, 2, 0])


def test_the_first_turn_acts_first():
    turns = (Turn(about=(0, 0, 1), amplitude_deg=90, hz=0), Turn(about=(1, 0, 0), amplitude_deg=90, hz=0))
    assert attitude(turns, 0.0) @ [1, 0, 0] == pytest.approx([0, 0, 1])


def test_every_attitude_is_a_rotation():
    turns = (Turn(about=(1, 2, 3), amplitude_deg=40, hz=1), Turn(about=(0, -1, 1), amplitude_deg=170, hz=0.3))
    R = attitude(turns, np.linspace(0, 5, 40))
    assert R @ np.swapaxes(R, -1, -2) == pytest.approx(np.broadcast_to(np.eye(3), R.shape))
    assert np.linalg.det(R) == pytest.approx(1)


def test_a_direction_without_length_is_refused():
    with pytest.raises(ValueError, match="no length"):
        position(Motion(oscillations=(Oscillation(along=(0, 0, 0), amplitude=1, hz=1),)), 0.0)
