"""Run-up: each transect's timestack with the water's edge that was found on it, and its height against time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import PALETTE, clock_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def timestacks(runup: DataFrame, stacks: Mapping[str, Mapping[str, Any]], units: str) -> Figure:
    """Two axes a transect: grey along the transect against time, the edge upon it; and the run-up, two sd shaded.

    runup    waterline.parquet: time_s, transect, s, z, sigma_z;  stacks: transect: {grey (T, n), time_s (T,), s (n,)}
    """
    figure, axes = new_figure(2 * len(stacks), 1, height=2.0, sharex=True, squeeze=False)
    for i, (name, stack) in enumerate(stacks.items()):
        image, height = axes[2 * i, 0], axes[2 * i + 1, 0]
        rows = runup[runup["transect"] == name]
        t, s = np.asarray(stack["time_s"], float), np.asarray(stack["s"], float)
        image.pcolormesh(t, s, np.asarray(stack["grey"]).T, cmap="gray", shading="nearest", rasterized=True)
        image.plot(rows["time_s"], rows["s"], color=PALETTE[1], lw=1.0)
        image.set_ylabel(f"up the transect ({units})", fontsize=8)
        image.set_title(name, fontsize=9, loc="left")
        z, sigma = rows["z"].to_numpy(float), rows["sigma_z"].to_numpy(float)
        height.plot(rows["time_s"], z, color=PALETTE[0], lw=0.9)
        height.fill_between(rows["time_s"], z - 2 * sigma, z + 2 * sigma, color=PALETTE[0], alpha=0.2, lw=0)
        height.set_ylabel(f"run-up z ({units})", fontsize=8)
    clock_axis(axes[-1, 0])
    return figure
