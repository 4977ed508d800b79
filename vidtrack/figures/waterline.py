"""The moving edge of the water: on the timestack of each transect, and as run-up against time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.drawing import INCH, Drawing, Picture, grey_uri, new_drawing
from vidtrack.figures.style import PALETTE

if TYPE_CHECKING:
    from pandas import DataFrame

WIDTH = 9.0


def timestacks(runup: DataFrame, stacks: Mapping[str, Mapping[str, Any]], units: str) -> Drawing:
    """Two axes a transect: grey along the transect against time, the edge upon it; and the run-up, two sd shaded.

    runup    waterline.parquet: time_s, transect, s, z, sigma_z;  stacks: transect: {grey (T, n), time_s (T,), s (n,)}
    """
    drawing = new_drawing(2 * len(stacks), 1, width=WIDTH, height=2.0, shared=True)
    for i, (name, stack) in enumerate(stacks.items()):
        image, height = drawing.axes[2 * i], drawing.axes[2 * i + 1]
        rows = runup[runup["transect"] == name]
        image.pictures.append(_picture(stack))
        image.plot(rows["time_s"], rows["s"], PALETTE[1])
        image.ylabel, image.title, image.grid = f"up the transect ({units})", name, False
        height.around(rows["time_s"], rows["z"], 2 * rows["sigma_z"], PALETTE[0])
        height.plot(rows["time_s"], rows["z"], PALETTE[0])
        height.ylabel = f"run-up z ({units})"
    drawing.axes[-1].clock()
    for ax in drawing.axes:
        ax.x_first = drawing.axes[-1].x_first
    return drawing


def _picture(stack: Mapping[str, Any]) -> Picture:
    """The timestack with time to the right and s upward: in each column of px the sample nearest in time."""
    t, s = np.asarray(stack["time_s"], float), np.asarray(stack["s"], float)
    grey = np.asarray(stack["grey"], float)
    columns, rows = np.linspace(t[0], t[-1], min(int(WIDTH * INCH), 4 * len(t))), np.linspace(s[0], s[-1], len(s))
    seen = grey[_nearest(t, columns)][:, _nearest(s, rows)]
    known = seen[np.isfinite(seen)]
    black, white = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    half_t, half_s = (abs(float(v[-1] - v[0])) / max(2 * (len(v) - 1), 1) for v in (t, s))
    uri = grey_uri(np.nan_to_num(seen.T[::-1], nan=black), black, white)
    return Picture(uri, t[0] - half_t, t[-1] + half_t, s[-1] + half_s, s[0] - half_s)


def _nearest(values: np.ndarray[Any, Any], at: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Index of the nearest of rising or falling values."""
    if len(values) < 2:
        return np.zeros(len(at), int)
    order = np.argsort(values)
    middle = (values[order][1:] + values[order][:-1]) / 2
    return np.asarray(order[np.searchsorted(middle, at)])
