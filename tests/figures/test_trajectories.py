"""Positions with units, uncertainty, gaps and equal scales."""

import numpy as np

from tests.figures.drawn import T, run, texts
from vidtrack.figures import trajectories


def test_trajectories_tell_units_uncertainty_and_gaps():
    table = run()
    table.loc[10:14, ["x", "y", "z"]] = np.nan
    figure = trajectories.against_time(table, "in", "pluck")
    assert {"x (in)", "y (in)", "z (in)"} <= set(texts(figure))
    assert len(figure.axes[0].bands) == 1
    ticks = [line for line in figure.axes[0].lines if line.label == "lost"]
    assert len(ticks[0].x) == 5
    assert "lost" in texts(figure)
    assert not trajectories.against_time(run(), "in", "pluck").axes[0].legend


def test_a_run_in_a_plane_shows_no_z():
    figure = trajectories.against_time(run(z=np.nan, sigma_z=np.nan), "m", "toss")
    assert "z (m)" not in texts(figure)
    assert len(trajectories.views(run(z=np.nan), "m", "toss").axes) == 1


def test_views_have_equal_scales():
    assert all(ax.equal == "limits" for ax in trajectories.views(run(), "in", "pluck").axes)


def test_kinematics_tell_velocity_and_acceleration_with_units():
    table = run(**{f"{k}{a}": np.sin(T) for k in "va" for a in "xyz"})
    assert {"velocity (in/s)", "acceleration (in/s²)"} <= set(texts(trajectories.derivatives(table, "in", "p")))


def test_an_unsure_end_does_not_flatten_the_motion():
    table = run(**{f"{k}{a}": np.sin(T) for k in "va" for a in "xyz"})
    table.loc[0, "az"], table.loc[0, "flag"] = 5000.0, "cam1:edge;edge"
    figure = trajectories.derivatives(table, "in", "p")
    assert figure.axes[1].ylim[1] < 2
    assert any(5000.0 in line.y for line in figure.axes[1].lines)
