"""Sweeps of a rig on paper."""

import numpy as np
import pandas as pd
import pytest

from tests.figures.drawn import texts
from vidtrack.figures import sensitivity


@pytest.mark.parametrize("numbers", [[2.0, 3.0], [np.nan, np.nan]])
def test_sweeps_are_drawn_by_number_or_by_name(numbers):
    table = pd.DataFrame({"sweep": ["", "n", "n"], "value": ["", "two", "three"], "number": [np.nan, *numbers]})
    table = table.assign(mean_3d=0.03, floor_3d=0.02, checked_mean_3d=0.031, sd_checked_mean_3d=0.001)
    figure = sensitivity.sweeps(table, "in")
    assert "mean 3-D error (in)" in texts(figure)
    assert "n" in texts(figure)


def test_the_volume_is_seen_from_above_and_from_the_side_in_one_scale_of_colours():
    volume = pd.DataFrame({"x": [0, 0, 1], "y": [0, 1, 0], "z": [0, 0, 1], "mean_3d": [0.1, 0.2, 0.3]})
    figure = sensitivity.volume_map(volume, "m")
    assert {"x (m)", "y (m)", "z (m)"} <= set(texts(figure))
    limits = [ax.collections[0].get_clim() for ax in figure.axes[:2]]
    assert limits == [(0.1, 0.3)] * 2
