"""The edge of the water on its timestack."""

import numpy as np
import pandas as pd

from tests.figures.drawn import T, texts
from vidtrack.figures import waterline


def test_the_waters_edge_lies_on_its_timestack():
    stack = {"grey": np.zeros((60, 40)), "time_s": T, "s": np.linspace(0, 4, 40)}
    runup = pd.DataFrame({"time_s": T, "transect": "mid", "s": 2.0, "z": 0.5, "sigma_z": 0.01})
    figure = waterline.timestacks(runup, {"mid": stack}, "ft")
    assert "run-up z (ft)" in texts(figure)
    assert list(figure.axes[0].lines[0].y) == [2.0] * 60
