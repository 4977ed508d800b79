"""Curves over the runs of a campaign."""

import numpy as np
import pytest

from tests.figures.drawn import texts
from vidtrack.figures.campaign import response_curves


def point(T, rao, phase=10.0):
    return {"T": T, "rao": {"value": rao, "half_width": 0.1}, "phase_deg": {"value": phase, "half_width": 2.0}}


def test_points_are_joined_in_the_order_of_their_periods_with_their_intervals():
    figure = response_curves({"b.heave": [point(1.6, 1.3), point(1.2, 0.9), point(2.0, None)]}, "m/m", "tank")
    ratio, phase = figure.axes
    line, bars = ratio.lines
    assert line.x.tolist() == [1.2, 1.6, 2.0]
    assert np.isnan(line.y[2])
    assert bars.y[:2].tolist() == pytest.approx([0.8, 1.0])
    assert "response over wave (m/m)" in texts(figure)
    assert "period of the waves (s)" in texts(figure)
    assert len(phase.lines) == 2


def test_a_phase_that_is_open_has_no_place():
    points = [
        {
            "run": "a",
            "T": T,
            "rao": {"value": 0.1, "half_width": 0.2},
            "phase_deg": {"value": 50.0, "half_width": width},
        }
        for T, width in ((1.0, 180.0), (2.0, 20.0))
    ]
    phases = response_curves({"b.yaw": points}, "deg/m", "b").axes[1]
    assert np.isnan(phases.lines[0].y).tolist() == [True, False]
