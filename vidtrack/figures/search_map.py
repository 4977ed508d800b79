"""The error over the search for the optical axis: where the minimum lies, and how flat it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.style import REJECTED_COLOUR, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def search_map(search: DataFrame, Cx: float, Cy: float, camera: str) -> Figure:
    """The map of one camera.

    search   Cx, Cy, rms_px on a grid (the grid's sensor width that fits best)
    Cx, Cy   px, the calibrated centre
    """
    grid = search.pivot_table(index="Cy", columns="Cx", values="rms_px", aggfunc="min")
    X, Y, rms = grid.columns.to_numpy(float), grid.index.to_numpy(float), grid.to_numpy(float)
    figure, ax = new_figure(width=5.6, height=4.6)
    low, high = float(np.nanmin(rms)), float(np.nanmax(rms))
    levels = np.geomspace(low, max(high, low * 1.001), 13)
    filled = ax.contourf(X, Y, rms, levels=levels, cmap="viridis_r", extend="both")
    lines = ax.contour(X, Y, rms, levels=levels[1::3], colors="white", linewidths=0.6)
    ax.clabel(lines, fmt="%.3g", fontsize=7)
    row, column = np.unravel_index(np.nanargmin(rms), rms.shape)
    ax.plot(X[column], Y[row], "o", mfc="none", mec="white", ms=8, label=f"least on the grid: {low:.4g} px")
    if X[0] <= Cx <= X[-1] and Y[0] <= Cy <= Y[-1]:
        ax.plot(Cx, Cy, "+", color=REJECTED_COLOUR, ms=12, mew=2, label=f"calibrated: {Cx:.1f}, {Cy:.1f}")
    figure.colorbar(filled, ax=ax, label="rms reprojection error (px)", format="%.3g")
    ax.set_aspect("equal")
    ax.invert_yaxis()
    ax.set_xlabel("Cx (px)", fontsize=8)
    ax.set_ylabel("Cy (px)", fontsize=8)
    ax.legend(fontsize=7, loc="lower left", framealpha=0.85)
    ax.set_title(f"{camera}: error over the search for the optical axis", fontsize=10)
    return figure
