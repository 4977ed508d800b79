"""The map of the search for the optical axis."""

import numpy as np
import pandas as pd
from matplotlib.contour import QuadContourSet

from tests.figures.drawn import texts
from vidtrack.figures import search_map


def test_the_search_map_shows_the_least_error_and_the_calibrated_centre():
    Cx, Cy = np.meshgrid(np.arange(230, 281, 5.0), np.arange(210, 261, 5.0))
    search = pd.DataFrame({"varied": "centre", "Cx": Cx.ravel(), "Cy": Cy.ravel(), "sensor_width": 8.8})
    search["rms_px"] = 0.1 + 1e-4 * ((search["Cx"] - 255) ** 2 + (search["Cy"] - 240) ** 2)
    figure = search_map.search_map(search, 256.0, 241.0, "cam1")
    said = texts(figure)
    assert "least on the grid: 0.1 px" in said
    assert "calibrated: 256.0, 241.0" in said
    assert any(isinstance(c, QuadContourSet) for c in figure.axes[0].collections)
