"""The uncertainty statement: parts add by squares, the largest is named, and its cure halves the whole."""

import re

import numpy as np
import pytest

from vidtrack.analysis.uncertainty import statement, uncertainty_statement
from vidtrack.freedom import DEGREES_OF_FREEDOM

BUDGET = {
    "x": {"survey": 0.3, "calibration": 0.1, "centroid": 0.2, "clock": 0.0},
    "y": {"survey": 0.1, "calibration": 0.1, "centroid": 0.1, "clock": 0.1},
    "z": {"survey": 0.0, "calibration": 0.0, "centroid": 0.5, "clock": 0.0},
}
AXES = {"waves": "-y", "up": "+z"}


def motions(origin=0.1, point=0.1, sd=1.0):
    own = {dof: {"sigma": origin, "sd": sd} for dof in DEGREES_OF_FREEDOM}
    other = {dof: {"sigma": point, "sd": sd} for dof in DEGREES_OF_FREEDOM}
    return {"float": {"origin": own, "CoG": other}}


def test_parts_add_by_their_squares_and_the_whole_is_expanded_twice():
    found = statement({"survey": 3.0, "calibration": 0.0, "centroid": 4.0})
    assert found["combined"] == pytest.approx(5)
    assert found["expanded"] == pytest.approx(10)
    assert found["dominant"] == "centroid"
    assert found["dominant_share"] == pytest.approx(0.64)


@pytest.mark.parametrize("parts", [{"survey": 5.0, "centroid": 1.0}, {"survey": 1.0, "centroid": 0.2, "clock": 0.3}])
def test_what_is_said_to_halve_it_halves_it(parts):
    found = statement(parts)
    left = float(re.search(r"tolerance is ([0-9.]+)", found["cure"]).group(1))
    after = np.sqrt(sum(u**2 for u in {**parts, "survey": left * parts["survey"]}.values()))
    assert after == pytest.approx(found["combined"] / 2, rel=0.03)


def test_where_one_part_is_not_enough_several_are_named():
    found = statement({"survey": 1.0, "calibration": 1.0, "centroid": 0.1})
    left = float(re.search(r"survey and calibration together at ([0-9.]+)", found["cure"]).group(1))
    assert np.sqrt(2 * left**2 + 0.01) == pytest.approx(found["combined"] / 2, rel=0.03)
    assert statement({"survey": 0.0})["cure"] is None


def test_each_motion_has_the_shares_of_its_own_axis():
    found = uncertainty_statement(BUDGET, motions(), AXES)
    surge, heave = (found["motions"]["float"]["origin"][dof]["parts"] for dof in ("surge", "heave"))
    assert surge["survey"] == pytest.approx(0.05)  # waves along -y: a quarter of y's variance
    assert heave["centroid"] == pytest.approx(0.1)
    assert found["positions"]["x"]["combined"] == pytest.approx(np.sqrt(0.14))


def test_the_lever_arm_is_what_a_point_has_beyond_the_origin():
    found = uncertainty_statement(BUDGET, motions(point=0.26), AXES)["motions"]["float"]["CoG"]
    assert found["heave"]["parts"]["lever arm"] == pytest.approx(0.24)
    assert found["heave"]["combined"] == pytest.approx(0.26)
    assert found["pitch"]["parts"]["lever arm"] == 0.0
    assert found["pitch"]["combined"] == pytest.approx(0.26)


def test_repeats_add_their_type_a_part():
    repeated = [motions(sd=sd) for sd in (1.0, 1.2, 1.1)]
    parts = uncertainty_statement(BUDGET, motions(), AXES, repeated)["motions"]["float"]["CoG"]["heave"]["parts"]
    assert parts["repeat"] == pytest.approx(0.1 / np.sqrt(3))
    assert (
        "repeat"
        not in uncertainty_statement(BUDGET, motions(), AXES, repeated[:1])["motions"]["float"]["CoG"]["heave"]["parts"]
    )


def test_a_run_without_a_budget_or_motions_states_what_there_is():
    assert uncertainty_statement(None, {}, {}) == {"k": 2.0, "positions": {}, "motions": {}}
