"""The analysis stage on tables as the other stages make them."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from vidtrack.analysis.decay import integrated
from vidtrack.errors import VidtrackError
from vidtrack.stages.analysis import COLUMNS, analysis

RATE = 60.0
AXES = {"waves": "+x", "up": "+z"}


def trajectory(columns, t, rng, target="t1", noise=0.005):
    table = pd.DataFrame({"time_s": t, "target": target, "x": 0.0, "y": 0.0, "z": 0.0} | columns)
    for axis in "xyz":
        table[axis] += rng.normal(0, noise, len(t))
        table[f"sigma_{axis}"] = noise
    return table


def swinging(rng):
    t = 36000 + np.arange(0, 12, 1 / RATE)
    x = np.full(t.shape, 20.0)
    moving = t > 36001
    x[moving] = integrated(np.concatenate([[36001.0], t[moving]]), 2 * np.pi * 0.8, 0.04, 0.0, 20.0, 0.0)[1:]
    return trajectory({"x": x, "y": 0.05 * x}, t, rng)


def body_in_waves(rng, f=0.5, heave=2.0, pitch_deg=3.0, lag_deg=40.0):
    t = np.arange(0, 40, 1 / RATE)
    wave = np.cos(2 * np.pi * f * t)
    swing = np.cos(2 * np.pi * f * t - np.radians(lag_deg))
    q = Rotation.from_euler("y", pitch_deg * swing[:, None], degrees=True).as_quat()[:, [3, 0, 1, 2]]
    table = pd.DataFrame({"time_s": t, "body": "float", "x": 1.0, "y": 2.0, "z": heave * swing})
    table[["x", "y", "z"]] += rng.normal(0, 0.01, (len(t), 3))
    table[["qw", "qx", "qy", "qz"]] = q
    pose = np.diag([1e-8] * 3 + [1e-4] * 3).ravel()
    table["covariance"] = list(np.tile(pose, (len(t), 1)))
    gauge = pd.DataFrame({"time_s": t, "eta": 1.5 * wave + rng.normal(0, 0.01, len(t))})
    return table, gauge


def test_a_free_decay_is_found_in_the_axis_that_moves_most():
    done = analysis(swinging(np.random.default_rng(0)), decay={}, units="in")
    decay = done.record["decay"]
    assert decay["series"] == "t1.x"
    assert abs(decay["fn_Hz"]["value"] - 0.8) < 2 * decay["fn_Hz"]["half_width"]
    assert abs(decay["zeta"]["value"] - 0.04) < 2 * decay["zeta"]["half_width"]
    assert decay["energy"]["y"] == pytest.approx(0.0025, rel=0.01)
    assert [f.code for f in done.findings if f.level != "note"] == []


def test_a_motion_that_does_not_decay_is_a_finding_and_no_number():
    rng = np.random.default_rng(1)
    t = np.arange(0, 5, 1 / RATE)
    done = analysis(trajectory({"x": t}, t, rng), decay={"series": "t1.x"})
    assert [f.code for f in done.findings] == ["decay-not-found"]
    assert "fn_Hz" not in done.record["decay"]


def test_a_second_frequency_in_the_motion_makes_the_decay_doubtful():
    table = swinging(np.random.default_rng(2))
    table["x"] += 0.3 * np.sin(2 * np.pi * 2.3 * table["time_s"])
    done = analysis(table, decay={"series": "t1.x"})
    assert "decay-misfit" in [f.code for f in done.findings if f.level == "doubtful"]


def test_the_response_to_a_regular_wave_is_amplitude_and_lag():
    bodies, gauge = body_in_waves(np.random.default_rng(3))
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    done = analysis(nothing, bodies, gauge, axes=AXES, waves={"elevation": "eta"}, units="m")
    waves = done.record["waves"]
    assert waves["kind"] == "regular"
    assert waves["T_s"]["value"] == pytest.approx(2.0, abs=1e-4)
    assert waves["H"]["value"] == pytest.approx(3.0, abs=0.005)
    heave, pitch = (waves["responses"][f"float.{dof}"] for dof in ("heave", "pitch"))
    assert heave["rao"]["value"] == pytest.approx(2 / 1.5, abs=0.003)
    assert heave["phase_deg"]["value"] == pytest.approx(40, abs=0.2)
    assert pitch["rao"]["value"] == pytest.approx(2.0, abs=0.001)
    assert pitch["unit"] == "deg"


def test_a_named_point_moves_with_the_arm_that_holds_it():
    bodies, _ = body_in_waves(np.random.default_rng(4), lag_deg=0.0, heave=0.0)
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    done = analysis(nothing, bodies, points={"float": {"bow": (10, 0, 0)}}, axes=AXES)
    bow = done.motions[done.motions["point"] == "bow"]
    assert list(done.motions.columns) == list(COLUMNS)
    assert bow["heave"].std() == pytest.approx(10 * np.radians(3) / np.sqrt(2), rel=0.01)
    assert bow["sigma_heave"].mean() == pytest.approx(np.hypot(0.01, 10 * 1e-4), rel=0.01)
    assert done.record["motions"]["float"]["bow"]["at_rest"][0] == pytest.approx(11, abs=0.02)


def test_irregular_waves_give_a_transfer_function_with_bands():
    rng = np.random.default_rng(5)
    t = np.arange(0, 600, 1 / 20)
    f, phase = rng.normal(0.4, 0.08, 200), rng.uniform(0, 2 * np.pi, 200)
    angle = 2 * np.pi * np.outer(t, f) + phase
    gauge = pd.DataFrame({"time_s": t, "eta": np.cos(angle).sum(axis=1)})
    table = trajectory({"z": 1.3 * np.cos(angle - 0.5).sum(axis=1)}, t, rng, noise=0.2)
    done = analysis(table, None, gauge, waves={"elevation": "eta"})
    waves = done.record["waves"]
    assert waves["kind"] == "irregular"
    assert waves["Hm0"] == pytest.approx(4 * gauge["eta"].std(), rel=0.02)
    own = waves["responses"]["t1.z"]
    use = (np.array(own["coherence"]) > 0.99) & np.isfinite(own["rao"])
    assert use.sum() > 5
    off = (np.array(own["rao"]) - 1.3)[use] / (np.array(own["rao_half_width"])[use])
    assert np.mean(np.abs(off) < 1) > 0.8
    assert np.median(np.array(own["phase_deg"])[use]) == pytest.approx(np.degrees(0.5), abs=1.0)


def test_a_name_that_fits_no_series_is_refused_with_those_that_there_are():
    with pytest.raises(VidtrackError, match=r"no series 'gauge'; there are t1\.x"):
        analysis(swinging(np.random.default_rng(6)), waves={"elevation": "gauge"})


def test_bodies_without_axes_are_refused():
    bodies, _ = body_in_waves(np.random.default_rng(7))
    with pytest.raises(VidtrackError, match="axes"):
        analysis(swinging(np.random.default_rng(6)), bodies)
