"""Motions at named points, and excursions from above."""

import numpy as np
import pandas as pd

from tests.figures.drawn import T, texts
from vidtrack.figures import motions

DOFS = motions.DEGREES_OF_FREEDOM


def table(points=("CoG",)):
    each = [
        pd.DataFrame(
            {"time_s": T, "point": point}
            | {dof: (i + 1) * np.sin(T + k) for k, dof in enumerate(DOFS)}
            | {f"sigma_{dof}": 0.1 for dof in DOFS}
        )
        for i, point in enumerate(points)
    ]
    return pd.concat(each)


def test_each_degree_of_freedom_has_its_axes_and_unit():
    shown = texts(motions.motions(table(("CoG", "bow")), "m", "float"))
    assert {"surge (m)", "heave (m)", "roll (deg)", "yaw (deg)", "CoG", "bow"} <= set(shown)


def test_the_envelope_is_at_equal_scales_with_its_circle():
    hull = np.array([[-1.0, 0], [1, 0], [0, 1]])
    figure = motions.envelope(table(), hull, 1.5, "m", "float")
    (ax,) = figure.axes
    assert ax.equal == "limits"
    path, envelope, circle = ax.lines
    assert len(path.x) == len(T)
    assert len(envelope.x) == 4  # closed
    assert np.hypot(circle.x, circle.y).max() < 1.5001
    assert len(motions.envelope(table(), hull[:0], 1.5, "m", "").axes[0].lines) == 2
