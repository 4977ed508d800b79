"""How well targets were followed: their tracks in the picture, pixel locking, the worst samples, the clock search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import PALETTE, clock_axis, legend, new_figure, picture_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def tracks(centroids: Mapping[str, DataFrame], colours: Mapping[str, str], title: str) -> Figure:
    """Xf and Yf of every target against time, a column of axes a camera."""
    figure, axes = new_figure(2, len(centroids), height=1.7, sharex="col", squeeze=False)
    for column, (camera, table) in zip(axes.T, centroids.items(), strict=True):
        for _, rows in table.groupby("target", sort=False):
            for ax, name in zip(column, ("Xf", "Yf"), strict=True):
                ax.plot(rows["time_s"], rows[name], color=colours[camera], lw=0.8, alpha=0.8)
        lost = table.loc[table["Xf"].isna(), "time_s"]
        if len(lost) and table["Xf"].notna().any():
            column[0].plot(lost, np.full(len(lost), table["Xf"].min()), "|", color="#B00020", ms=5)
        column[0].set_title(f"{camera}" + (f" ({len(lost)} samples lost, red)" if len(lost) else ""), fontsize=9)
        clock_axis(column[1])
    axes[0, 0].set_ylabel("Xf (px)", fontsize=8)
    axes[1, 0].set_ylabel("Yf (px)", fontsize=8)
    figure.suptitle(title, fontsize=10)
    return figure


def tracks_over_picture(picture: np.ndarray[Any, Any], table: DataFrame, camera: str) -> Figure:
    """Where each target was seen, over the picture with which the recording begins; a colour a target.

    picture   (h, w) grey. Where a target was lost, the way to where it was found again is dotted in red.
    """
    height, width = picture.shape[:2]
    figure, ax = new_figure(width=5.2, height=5.2 * height / width + 0.6)
    ax.imshow(picture, cmap="gray", vmin=0, vmax=max(float(np.percentile(picture, 99.9)), 1.0), interpolation="nearest")
    picture_axes(ax, width, height)
    gaps = 0
    for i, (target, rows) in enumerate(table.groupby("target", sort=False)):
        b = rows[["Xf", "Yf"]].to_numpy(float)
        ax.plot(*b.T, color=PALETTE[(i + 4) % len(PALETTE)], lw=0.9, label=str(target))
        seen = np.flatnonzero(np.isfinite(b[:, 0]))
        for k in np.flatnonzero(np.diff(seen) > 1):
            gaps += 1
            ax.plot(*b[[seen[k], seen[k + 1]]].T, color="#ff4040", lw=1.2, ls=":")
    lost = f", {gaps} lost stretches dotted red" if gaps else ""
    legend(ax, fontsize=7, loc="upper right")
    ax.set_title(f"{camera}: tracks{lost}", fontsize=9)
    return figure


def pixel_locking(records: Mapping[str, Mapping[str, Any]], colours: Mapping[str, str]) -> Figure:
    """Where within a pixel the centroids lie: flat is good; a peak means that they prefer a place (pixel locking)."""
    figure, axes = new_figure(1, 2, height=2.2, sharey=True)
    for camera, record in records.items():
        for ax, axis in zip(axes, "xy", strict=True):
            histogram = record["pixel_locking"][axis]
            counts, edges = (np.asarray(histogram[key], float) for key in ("counts", "edges"))
            if counts.sum():
                ax.stairs(counts / counts.mean(), edges, color=colours[camera], lw=1.2, label=camera)
    for ax, axis in zip(axes, ("Xf", "Yf"), strict=True):
        ax.axhline(1, color="#444444", lw=0.6, ls=":")
        ax.set_xlabel(f"{axis} within the pixel (px)", fontsize=8)
        ax.set_ylim(bottom=0)
    axes[0].set_ylabel("share, times the mean", fontsize=8)
    legend(axes[0], fontsize=7)
    return figure


def worst_moments(crops: Sequence[Mapping[str, Any]], camera: str) -> Figure:
    """Pieces of the picture around the targets in the worst samples, each with its flag."""
    figure, axes = new_figure(1, len(crops), width=min(9.0, 1.5 * len(crops) + 0.4), height=1.8, squeeze=False)
    for ax, crop in zip(axes[0], crops, strict=True):
        picture = np.asarray(crop["picture"])
        ax.imshow(picture, cmap="gray", interpolation="nearest")
        ax.set_xticks([])
        ax.set_yticks([])
        ax.grid(False)
        ax.set_title(f"frame {crop['frame']}\n{crop['target']}: {crop['flag'] or 'least contrast'}", fontsize=7)
    figure.suptitle(camera, fontsize=8, color=PALETTE[7])
    return figure


def clock_search(clocks: Mapping[str, Mapping[str, Any]], colours: Mapping[str, str]) -> Figure:
    """The epipolar error against a camera's clock offset: the minimum is the estimate."""
    figure, ax = new_figure(width=6, height=2.6)
    for camera, own in clocks.items():
        if own.get("offsets_s"):
            offsets = np.asarray(own["offsets_s"], float)
            ax.plot(1000 * offsets, np.array(own["error_px"], float), color=colours[camera], lw=1.2, label=camera)
            ax.axvline(1000 * own["offset_s"], color=colours[camera], lw=0.8, ls=":")
    ax.set_xlabel("offset of the camera's clock (ms)", fontsize=8)
    ax.set_ylabel("epipolar error (px rms)", fontsize=8)
    legend(ax, fontsize=7)
    return figure
