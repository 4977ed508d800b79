"""The overlay runs downward at equal scales, with magnified arrows and rejected points."""

import numpy as np
import pandas as pd

from tests.figures.drawn import texts
from vidtrack.figures.overlay import overlay


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
