"""The error over the search for the optical axis: where the minimum lies, and how flat it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.style import PALETTE, REJECTED_COLOUR, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def search_map(search: DataFrame, Cx: float, Cy: float, camera: str) -> Figure:
    """The map of one camera.

    search   search.parquet: varied (centre, sensor), Cx, Cy, sensor_width, rms_px
    Cx, Cy   px, the calibrated centre
    """
    centre = search[search["varied"] == "centre"]
    grid = centre.pivot_table(index="Cy", columns="Cx", values="rms_px", aggfunc="min")
    X, Y, rms = grid.columns.to_numpy(float), grid.index.to_numpy(float), grid.to_numpy(float)
    figure, (ax, side) = new_figure(1, 2, width=9, height=4.4, width_ratios=(2.2, 1))
    low, high = float(np.nanmin(rms)), float(np.nanmax(rms))
    levels = np.geomspace(low, max(high, low * 1.001), 13)
    filled = ax.contourf(X, Y, rms, levels=levels, cmap="viridis_r", extend="both")
    lines = ax.contour(X, Y, rms, levels=levels[1::3], colors="white", linewidths=0.6)
    ax.clabel(lines, fmt="%.3g", fontsize=7)
    row, column = np.unravel_index(np.nanargmin(rms), rms.shape)
    ax.plot(X[column], Y[row], "o", mfc="none", mec="white", ms=6, label=f"least on the grid: {low:.4g} px")
    if X[0] <= Cx <= X[-1] and Y[0] <= Cy <= Y[-1]:
        ax.plot(Cx, Cy, "+", color=REJECTED_COLOUR, ms=9, mew=2, label=f"calibrated: {Cx:.1f}, {Cy:.1f}")
    bar = figure.colorbar(filled, ax=ax, format="%.3g")
    bar.set_label("rms reprojection error (px)", fontsize=8)
    bar.ax.tick_params(labelsize=8)
    ax.set_aspect("equal")
    ax.invert_yaxis()
    ax.set_xlabel("Cx (px)", fontsize=8)
    ax.set_ylabel("Cy (px)", fontsize=8)
    # below the map, where it hides nothing; grey, because one of its markers is white
    legend(ax, fontsize=7, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.12), facecolor="#9a9a9a")
    ax.set_title(f"{camera}: error over the search for the optical axis", fontsize=10)
    sensor = search[search["varied"] == "sensor"]
    side.plot(sensor["sensor_width"], sensor["rms_px"], ".-", color=PALETTE[0], lw=1)
    side.set_xlabel("width of the sensor (mm)", fontsize=8)
    side.set_title("and over its width", fontsize=10)
    side.set_ylim(bottom=0)
    if sensor.empty:
        side.set_visible(False)
    return figure
