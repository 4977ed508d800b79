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


def test_angles_are_also_given_over_the_slope_of_the_wave_where_the_depth_is_known():
    bodies, gauge = body_in_waves(np.random.default_rng(3))
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    waves = {"elevation": "eta", "depth": "deep", "distance": 4.0}
    done = analysis(nothing, bodies, gauge, axes=AXES, waves=waves, units="m")
    k = (2 * np.pi * 0.5) ** 2 / 9.80665
    heave, pitch = (done.record["waves"]["responses"][f"float.{dof}"] for dof in ("heave", "pitch"))
    assert pitch["rao_slope"]["value"] == pytest.approx(3.0 / np.degrees(k * 1.5), rel=0.002)
    assert "rao_slope" not in heave
    assert heave["phase_deg"]["value"] == pytest.approx(40 - np.degrees(4 * k) + 360, abs=0.3)
    assert "4 behind the gauge" in done.record["waves"]["phase_means"]


def test_a_clock_that_is_known_less_well_widens_the_phase_and_an_unknown_one_gives_none():
    bodies, gauge = body_in_waves(np.random.default_rng(3))
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    lamp = gauge.assign(led=(np.floor(gauge["time_s"] / 3.7) % 2))
    how = {"axes": AXES, "waves": {"elevation": "eta"}, "units": "m", "given": ["eta"], "clock": {"lamp": "led"}}
    within = gauge["time_s"].to_numpy()[:, None] + np.arange(50) / 50 / RATE
    light = pd.DataFrame({"begun_s": gauge["time_s"], "brightness": 30 + 50 * (np.floor(within / 3.7) % 2).mean(1)})
    done = analysis(nothing, bodies, lamp, light={"cam1": light}, **how)
    phase = done.record["waves"]["responses"]["float.heave"]["phase_deg"]
    assert done.record["channels"]["clock"]["method"] == "lamp"
    assert abs(phase["value"] - 40) < phase["half_width"] < 3
    assert phase["half_width"] > 1.96 * 360 * 0.5 * done.record["channels"]["clock"]["offset_sd_s"]
    unseen = analysis(nothing, bodies, lamp, light={}, **how)
    assert np.isnan(unseen.record["waves"]["responses"]["float.heave"]["phase_deg"]["value"])
    assert "lamp-not-seen" in [f.code for f in unseen.findings]


def test_the_wave_itself_never_joins_the_clocks():
    bodies, gauge = body_in_waves(np.random.default_rng(3))
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    clock = {"motion": "eta", "series": "float.heave"}
    with pytest.raises(VidtrackError, match="the wave itself"):
        analysis(nothing, bodies, gauge, axes=AXES, waves={"elevation": "eta"}, clock=clock)


def test_motions_are_about_rest_where_that_is_asked_for():
    bodies, _ = body_in_waves(np.random.default_rng(4), lag_deg=90.0)
    still = bodies["time_s"] < 4
    bodies.loc[still, ["x", "y", "z"]] = np.random.default_rng(1).normal([1.0, 2.0, 0.0], 0.01, (still.sum(), 3))
    bodies.loc[still, ["qw", "qx", "qy", "qz"]] = [1.0, 0.0, 0.0, 0.0]
    bodies["z"] += np.where(still, 0, 1.0)
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    for about, mean in (("mean", 0.0), ("rest", 0.9), ([0.0, 3.5], 0.9)):
        done = analysis(nothing, bodies, axes=AXES, about=about)
        assert done.motions["heave"].mean() == pytest.approx(mean, abs=0.03)
    with pytest.raises(VidtrackError, match="in motion from the first sample on"):
        analysis(nothing, bodies[~still], axes=AXES, about="rest")


def test_the_gauge_is_cut_to_the_time_of_the_motions():
    """Waves that the camera did not see, before they were steady, are not used."""
    bodies, gauge = body_in_waves(np.random.default_rng(3))
    before = gauge.assign(time_s=gauge["time_s"] - 40.0, eta=0.1 * gauge["eta"])
    nothing = pd.DataFrame({"time_s": [], "target": [], "x": [], "y": [], "z": []})
    done = analysis(nothing, bodies, pd.concat([before, gauge]), axes=AXES, waves={"elevation": "eta"}, units="m")
    assert done.record["waves"]["H"]["value"] == pytest.approx(3.0, abs=0.01)
    assert done.record["waves"]["periods"] in (19, 20)


def test_a_target_that_floats_is_a_wave_gauge():
    rng = np.random.default_rng(7)
    t = np.arange(0, 40, 1 / RATE)
    buoy = trajectory({"z": 0.5 * np.cos(np.pi * t), "x": 0.4 * np.sin(np.pi * t)}, t, rng, target="buoy", noise=0.002)
    waves = analysis(buoy, waves={"elevation": "buoy"}, axes=AXES, units="m").record["waves"]
    assert waves["elevation"] == "buoy.z"
    assert waves["H"]["value"] == pytest.approx(1.0, abs=0.002)
