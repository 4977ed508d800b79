"""Figures say what they show: units, equal scales, Y downward, magnified arrows that tell, rejected points drawn."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.contour import QuadContourSet

from vidtrack.figures import bodies, comparison, search_map, sensitivity, tracking, trajectories, waterline
from vidtrack.figures.overlay import overlay
from vidtrack.figures.style import camera_colours, clock_axis, magnification, new_figure

T = np.arange(60) / 30 + 36000.0


def run(**columns):
    base = {"time_s": T, "target": "t1", "x": np.sin(T), "y": np.cos(T), "z": 0 * T}
    base |= {f"sigma_{a}": 0.01 for a in "xyz"} | {"flag": ""}
    return pd.DataFrame({**base, **columns})


def texts(figure):
    found = [t.get_text() for ax in figure.axes for t in (ax.title, ax.xaxis.label, ax.yaxis.label, *ax.texts)]
    for ax in figure.axes:
        if ax.get_legend():
            found += [t.get_text() for t in ax.get_legend().get_texts()]
        found.append(ax.get_title(loc="left"))
    return found


def test_magnification_is_a_round_number_that_shows_typical_arrows():
    assert magnification([0.1, 0.2, 0.3], 10) == 50
    assert magnification([100.0], 10) == 1
    assert magnification([np.nan], 10) == 1


def test_a_camera_keeps_its_colour_whatever_the_figure():
    assert camera_colours(["a", "b"])["a"] == camera_colours(["a", "b", "c"])["a"]


def test_seconds_since_midnight_are_told_from_a_whole_second_on():
    _figure, ax = new_figure()
    ax.plot(T, T)
    clock_axis(ax)
    assert ax.get_xlabel() == "time (s after 10:00:00)"
    assert ax.xaxis.get_major_formatter()(36001.5, None) == "1.5"


def points():
    rng = np.random.default_rng(1)
    b = rng.uniform(20, 80, (20, 2))
    table = pd.DataFrame({"tag": [str(i) for i in range(20)], "Xf": b[:, 0], "Yf": b[:, 1], "used": True, "reason": ""})
    table.loc[3, ["used", "reason"]] = [False, "swapped with tag 4"]
    back = table.assign(
        Xf_projected=b[:, 0] + 0.1, Yf_projected=b[:, 1], Xf_from_located=b[:, 0], Yf_from_located=b[:, 1]
    )
    return table, back


def test_the_overlay_runs_downward_at_equal_scales_and_names_what_was_rejected():
    table, back = points()
    figure = overlay(np.full((100, 100), 30, np.uint8), table, back, "cam1")
    ax = figure.axes[0]
    assert ax.yaxis_inverted()
    assert ax.get_aspect() == 1.0
    said = " ".join(texts(figure))
    assert "rejected (1)" in said
    assert "20 times; rms 0.100 px" in said
    assert "3" in [t.get_text() for t in ax.texts]


def test_the_search_map_shows_the_least_error_and_the_calibrated_centre():
    Cx, Cy = np.meshgrid(np.arange(230, 281, 5.0), np.arange(210, 261, 5.0))
    search = pd.DataFrame({"varied": "centre", "Cx": Cx.ravel(), "Cy": Cy.ravel(), "sensor_width": 8.8})
    search["rms_px"] = 0.1 + 1e-4 * ((search["Cx"] - 255) ** 2 + (search["Cy"] - 240) ** 2)
    figure = search_map.search_map(search, 256.0, 241.0, "cam1")
    said = texts(figure)
    assert "least on the grid: 0.1 px" in said
    assert "calibrated: 256.0, 241.0" in said
    assert any(isinstance(c, QuadContourSet) for c in figure.axes[0].collections)


def test_trajectories_tell_units_uncertainty_and_gaps():
    table = run()
    table.loc[10:14, ["x", "y", "z"]] = np.nan
    figure = trajectories.against_time(table, "in", "pluck")
    assert {"x (in)", "y (in)", "z (in)"} <= set(texts(figure))
    assert len(figure.axes[0].collections) == 1
    ticks = [line for line in figure.axes[0].lines if line.get_label() == "lost"]
    assert len(ticks[0].get_xdata()) == 5
    assert "lost" in [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert trajectories.against_time(run(), "in", "pluck").axes[0].get_legend() is None


def test_a_run_in_a_plane_shows_no_z():
    figure = trajectories.against_time(run(z=np.nan, sigma_z=np.nan), "m", "toss")
    assert "z (m)" not in texts(figure)
    assert len(trajectories.views(run(z=np.nan), "m", "toss").axes) == 1


def test_views_have_equal_scales():
    assert all(ax.get_aspect() == 1.0 for ax in trajectories.views(run(), "in", "pluck").axes)


def test_kinematics_tell_velocity_and_acceleration_with_units():
    table = run(**{f"{k}{a}": np.sin(T) for k in "va" for a in "xyz"})
    assert {"velocity (in/s)", "acceleration (in/s$^2$)"} <= set(texts(trajectories.derivatives(table, "in", "p")))


def test_an_unsure_end_does_not_flatten_the_motion():
    table = run(**{f"{k}{a}": np.sin(T) for k in "va" for a in "xyz"})
    table.loc[0, "az"], table.loc[0, "flag"] = 5000.0, "cam1:edge;edge"
    figure = trajectories.derivatives(table, "in", "p")
    assert figure.axes[1].get_ylim()[1] < 2
    assert any(5000.0 in line.get_ydata() for line in figure.axes[1].lines)


def test_the_comparison_tells_lag_gain_and_limits_of_agreement():
    x = np.sin(3 * T)
    series = pd.DataFrame({"time_s": T, "video": x, "reference": x + 0.3, "reference_aligned": x + 0.01})
    series["difference_aligned"] = 0.01
    series["mean_aligned"] = x
    record = {"lag_s": 0.2, "axis": {"asked": "x"}}
    record["after"] = {"gain": 1.0, "bias": 0.01, "mean_difference": 0.01, "limits": [-0.1, 0.12]}
    figures = dict(comparison.comparisons(series, record, "in"))
    said = [t for figure in figures.values() for t in texts(figure)]
    assert "reference moved 0.2000 s later" in said
    assert "gain 1.0000, bias 0.010 in" in said
    assert "limits of agreement -0.100 to 0.120" in said


def test_bodies_show_six_degrees_of_freedom():
    table = run(body="float", **dict.fromkeys(("roll", "pitch", "yaw"), 1.0))
    table = table.assign(**dict.fromkeys(("sigma_roll", "sigma_pitch", "sigma_yaw"), 0.1))
    figure = bodies.six_degrees(table, "in", "float")
    assert {"x (in)", "roll (deg)", "pitch (deg)", "yaw (deg)"} <= set(texts(figure))


def test_tracks_count_what_was_lost():
    table = pd.DataFrame({"time_s": T, "target": "t1", "Xf": np.sin(T), "Yf": np.cos(T)})
    table.loc[:4, ["Xf", "Yf"]] = np.nan
    figure = tracking.tracks({"cam1": table}, {"cam1": "red"}, "run")
    assert any("5 samples lost" in t for t in texts(figure))


def test_the_clocks_curve_is_in_milliseconds():
    clocks = {"cam2": {"offset_s": 0.01, "offsets_s": [0.0, 0.01, 0.02], "error_px": [1.0, 0.1, 1.0]}}
    figure = tracking.clock_search(clocks, {"cam2": "red"})
    assert list(figure.axes[0].lines[0].get_xdata()) == [0, 10, 20]


def test_the_waters_edge_lies_on_its_timestack():
    stack = {"grey": np.zeros((60, 40)), "time_s": T, "s": np.linspace(0, 4, 40)}
    runup = pd.DataFrame({"time_s": T, "transect": "mid", "s": 2.0, "z": 0.5, "sigma_z": 0.01})
    figure = waterline.timestacks(runup, {"mid": stack}, "ft")
    assert "run-up z (ft)" in texts(figure)
    assert list(figure.axes[0].lines[0].get_ydata()) == [2.0] * 60


@pytest.mark.parametrize("numbers", [[2.0, 3.0], [np.nan, np.nan]])
def test_sweeps_are_drawn_by_number_or_by_name(numbers):
    table = pd.DataFrame({"sweep": ["", "n", "n"], "value": ["", "two", "three"], "number": [np.nan, *numbers]})
    table = table.assign(mean_3d=0.03, floor_3d=0.02, checked_mean_3d=0.031, sd_checked_mean_3d=0.001)
    figure = sensitivity.sweeps(table, "in")
    assert "mean 3-D error (in)" in texts(figure)
    assert "n" in texts(figure)
