"""What a rig's accuracy depends on: one plot a sweep, and the accuracy over the volume."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.figures.style import PALETTE, REFERENCE_COLOUR, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def sweeps(table: DataFrame, units: str) -> Figure:
    """Mean 3-D error against every swept entry: predicted (line), simulated (dots, two sd), exact cameras (dotted).

    table   a row a case: sweep, value, number, mean_3d, floor_3d and as there are checked_mean_3d, sd_checked_mean_3d
    """
    planned = table.iloc[0]
    groups = [(name, rows) for name, rows in table.iloc[1:].groupby("sweep", sort=False)]
    columns = 3 if len(groups) > 4 else max(1, min(2, len(groups)))
    lines = max(1, -(-len(groups) // columns))
    figure, axes = new_figure(lines, columns, width=3.6 * columns, height=2.6, squeeze=False)
    for ax in axes.ravel()[len(groups) :]:
        ax.set_visible(False)
    for ax, (name, rows) in zip(axes.ravel(), groups, strict=False):
        numbers = rows["number"].to_numpy(float)
        by_number = bool(np.isfinite(numbers).all())
        x = numbers if by_number else np.arange(len(rows), dtype=float)
        ax.plot(x, rows["mean_3d"], "-", color=PALETTE[0], lw=1.3, label="predicted")
        ax.plot(x, rows["floor_3d"], ":", color=REFERENCE_COLOUR, lw=1, label="exact cameras")
        if "checked_mean_3d" in rows and rows["checked_mean_3d"].notna().any():
            bars = 2 * rows["sd_checked_mean_3d"] if "sd_checked_mean_3d" in rows else None
            ax.errorbar(x, rows["checked_mean_3d"], yerr=bars, fmt="o", ms=4, color=PALETTE[1], label="simulated")
        ax.axhline(planned["mean_3d"], color=PALETTE[2], lw=0.7, ls="--", label="as planned")
        if not by_number:
            ax.set_xticks(x, [str(v) for v in rows["value"]], rotation=20, ha="right", fontsize=6)
        ax.set_xlabel(str(name), fontsize=8)
        ax.set_ylim(bottom=0)
    for ax in axes[:, 0]:
        ax.set_ylabel(f"mean 3-D error ({units})", fontsize=8)
    legend(axes[0, 0], fontsize=6)
    return figure


def volume_map(volume: DataFrame, units: str) -> Figure:
    """The error of the planned rig over the volume, from above and from the side.

    volume   a row a place: x, y, z and mean_3d (world units)
    """
    figure, axes = new_figure(1, 2, height=3.2)
    low, high = float(volume["mean_3d"].min()), float(volume["mean_3d"].max())
    for ax, up in zip(axes, ("y", "z"), strict=True):
        mean = volume.groupby(["x", up], as_index=False)["mean_3d"].mean()
        ax.scatter(mean["x"], mean[up], c=mean["mean_3d"], s=60, cmap="viridis_r", vmin=low, vmax=high)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"x ({units})", fontsize=8)
        ax.set_ylabel(f"{up} ({units})", fontsize=8)
    figure.colorbar(axes[0].collections[0], ax=axes, label=f"mean 3-D error ({units})")
    return figure
