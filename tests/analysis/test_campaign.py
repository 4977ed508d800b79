"""A campaign of runs whose responses, scatter and scale were put in."""

import numpy as np
import pytest

from vidtrack.analysis.campaign import campaign, type_a


def estimate(value, half_width=0.01):
    return {"value": value, "half_width": half_width}


def waves(T, rao, phase):
    heave = {"unit": "m", "rao": estimate(rao), "phase_deg": estimate(phase, 1.0)}
    pitch = {"unit": "deg", "rao": estimate(20.0), "phase_deg": estimate(0.0)}
    return {
        "waves": {
            "kind": "regular",
            "H": estimate(0.1),
            "T_s": estimate(T),
            "responses": {"b.heave": heave, "b.pitch": pitch},
        }
    }


def decay(fn, series="b.pitch"):
    own = {"Td_s": estimate(1 / fn), "fn_Hz": estimate(fn), "zeta": estimate(0.05), "quadratic": estimate(0.1)}
    return {"decay": {"series": series, **own}}


ROWS = [
    {"run": "w1", "H": 0.1, "T": 1.2, "scale": 25.0, "analysis": "w", "notes": "calm"},
    {"run": "w2", "H": 0.1, "T": 1.2, "scale": 25.0, "analysis": "w"},
    {"run": "w3", "H": 0.1, "T": 1.2, "scale": 25.0, "analysis": "w"},
    {"run": "w4", "H": 0.1, "T": 1.6, "scale": 25.0, "analysis": "w"},
    {"run": "d1", "analysis": "d"},
    {"run": "d2", "analysis": "d"},
    {"run": "later", "H": 0.2, "T": 1.2, "scale": 25.0},
]
RECORDS = {
    "w1": waves(1.2, 0.9, 179.0),
    "w2": waves(1.21, 1.1, -179.0),
    "w3": waves(1.19, 1.0, 180.0),
    "w4": waves(1.6, 1.3, 10.0),
    "d1": decay(0.5),
    "d2": decay(0.52),
}


def test_type_a_is_the_deviation_of_the_mean_with_student_s_interval():
    found = type_a([1.0, 2.0, 3.0, float("nan")])
    assert found == pytest.approx(
        {"n": 3, "mean": 2, "sd": 1, "u_A": 1 / np.sqrt(3), "half_width": 4.30265 / np.sqrt(3)}
    )
    assert type_a([1.0])["u_A"] is None


def test_each_run_has_its_conditions_and_what_was_measured():
    found = campaign(ROWS, RECORDS)["runs"]
    assert list(found) == [row["run"] for row in ROWS]
    assert (found["w1"]["H"], found["w1"]["notes"], found["w1"]["measured"]["T_s"]["value"]) == (0.1, "calm", 1.2)
    assert found["later"]["analysed"] is False
    assert found["d1"]["measured"]["fn_Hz"]["value"] == 0.5


def test_repeats_scatter_by_what_was_put_in_and_phases_do_not_break_at_half_a_turn():
    (three, two) = campaign(ROWS, RECORDS)["repeats"]
    assert three["runs"] == ["w1", "w2", "w3"]
    heave = three["responses"]["b.heave"]
    assert heave["rao"]["sd"] == pytest.approx(0.1)
    assert heave["phase_deg"]["sd"] == pytest.approx(1.0)
    assert heave["phase_deg"]["mean"] == pytest.approx(180)
    assert two["quantities"]["fn_Hz"]["mean"] == pytest.approx(0.51)


def test_decays_are_pooled_over_their_repeats_and_only_of_one_motion():
    (found,) = campaign(ROWS, RECORDS)["pooled"]
    assert found["runs"] == ["d1", "d2"]
    assert found["fn_Hz"]["value"] == pytest.approx(0.51, abs=1e-9)
    assert found["fn_Hz"]["half_width"] > 0.1  # two that scatter by more than they say: Student's t of one freedom
    assert campaign(ROWS, RECORDS | {"d2": decay(0.52, "b.roll")})["pooled"] == []


def test_full_size_follows_froude_where_a_scale_is_set():
    found = campaign(ROWS, RECORDS)["runs"]
    whole = found["w1"]["full_scale"]
    assert whole["H"] == pytest.approx(2.5)
    assert whole["T_s"] == pytest.approx(6.0)
    assert whole["responses"] == pytest.approx({"b.heave": 0.9, "b.pitch": 20 / 25})
    assert found["d1"]["full_scale"] == {}
    assert found["later"]["full_scale"] == {"H": 5.0, "T": 6.0, "responses": {}}
