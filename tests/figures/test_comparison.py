"""The comparison with a contact sensor."""

import numpy as np
import pandas as pd

from tests.figures.drawn import T, texts
from vidtrack.figures import comparison


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
