"""Tables that figures are drawn from, and the texts that a figure shows."""

import numpy as np
import pandas as pd

from vidtrack.figures.drawing import Drawing

T = np.arange(60) / 30 + 36000.0


def run(**columns):
    base = {"time_s": T, "target": "t1", "x": np.sin(T), "y": np.cos(T), "z": 0 * T}
    base |= {f"sigma_{a}": 0.01 for a in "xyz"} | {"flag": ""}
    return pd.DataFrame({**base, **columns})


def texts(figure):
    if isinstance(figure, Drawing):
        return figure.texts()
    found = [t.get_text() for ax in figure.axes for t in (ax.title, ax.xaxis.label, ax.yaxis.label, *ax.texts)]
    for ax in figure.axes:
        if ax.get_legend():
            found += [t.get_text() for t in ax.get_legend().get_texts()]
        found.append(ax.get_title(loc="left"))
    return found
