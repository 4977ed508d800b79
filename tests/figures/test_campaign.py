"""Curves over the runs of a campaign."""

import numpy as np

from tests.figures.drawn import texts
from vidtrack.figures.campaign import response_curves


def point(T, rao, phase=10.0):
    return {"T": T, "rao": {"value": rao, "half_width": 0.1}, "phase_deg": {"value": phase, "half_width": 2.0}}


def test_points_are_joined_in_the_order_of_their_periods_with_their_intervals():
    figure = response_curves({"b.heave": [point(1.6, 1.3), point(1.2, 0.9), point(2.0, None)]}, "m/m", "tank")
    ratio, phase = figure.axes
    line = ratio.containers[0][0]
    assert line.get_xdata().tolist() == [1.2, 1.6, 2.0]
    assert np.isnan(line.get_ydata()[2])
    bar = ratio.containers[0][2][0].get_segments()[0]
    assert np.ptp(bar[:, 1]) == np.float64(0.2) or abs(np.ptp(bar[:, 1]) - 0.2) < 1e-12
    assert "response over wave (m/m)" in texts(figure)
    assert "period of the waves (s)" in texts(figure)
    assert len(phase.containers) == 1
