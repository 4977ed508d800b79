"""How well targets were followed: their tracks in the picture, pixel locking, the worst samples, the clock search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.drawing import INK, Drawing, Picture, grey_uri, new_drawing, picture_axes
from vidtrack.figures.style import PALETTE, REJECTED_COLOUR, over_picture

if TYPE_CHECKING:
    from pandas import DataFrame

MANY = 8
"""Beyond so many targets a legend is of no use."""

FOUND_AGAIN = "#ff4040"


def tracks(centroids: Mapping[str, DataFrame], colours: Mapping[str, str], title: str) -> Drawing:
    """Xf and Yf of every target against time, a column of axes a camera."""
    drawing = new_drawing(2, len(centroids), height=1.7, shared=True, title=title)
    for column, (camera, table) in zip(zip(*drawing.grid, strict=True), centroids.items(), strict=True):
        for _, rows in table.groupby("target", sort=False):
            for ax, name in zip(column, ("Xf", "Yf"), strict=True):
                ax.plot(rows["time_s"], rows[name], colours[camera], width=1.0)
        lost = table.loc[table["Xf"].isna(), "time_s"]
        if len(lost) and table["Xf"].notna().any():
            column[0].dots(lost, np.full(len(lost), table["Xf"].min()), REJECTED_COLOUR, mark="|", size=7.0)
        column[0].title = f"{camera}" + (f" ({len(lost)} samples lost, red)" if len(lost) else "")
        column[1].clock()
        column[0].x_first = column[1].x_first
    drawing.grid[0][0].ylabel, drawing.grid[1][0].ylabel = "Xf (px)", "Yf (px)"
    return drawing


def tracks_over_picture(picture: np.ndarray[Any, Any], table: DataFrame, camera: str) -> Drawing:
    """Where each target was seen, over the picture with which the recording begins; a colour a target.

    picture   (h, w) grey. Where a target was lost, the way to where it was found again is dotted in red.
    """
    height, width = picture.shape[:2]
    drawing = new_drawing(width=4.6, height=4.05 * height / width + 0.75)
    (ax,) = drawing.axes
    picture_axes(ax, picture, max(float(np.percentile(picture, 99.9)), 1.0))
    gaps = 0
    for i, (target, rows) in enumerate(table.groupby("target", sort=False)):
        b = rows[["Xf", "Yf"]].to_numpy(float)
        ax.plot(b[:, 0], b[:, 1], over_picture(PALETTE[i % len(PALETTE)]), label=str(target))
        seen = np.flatnonzero(np.isfinite(b[:, 0]))
        for k in np.flatnonzero(np.diff(seen) > 1):
            gaps += 1
            ends = b[[seen[k], seen[k + 1]]]
            ax.plot(ends[:, 0], ends[:, 1], FOUND_AGAIN, width=1.6, dash="1 3")
    ax.title = f"{camera}: tracks" + (f", {gaps} lost stretches dotted red" if gaps else "")
    ax.legend = table["target"].nunique() <= MANY
    return drawing


def pixel_locking(records: Mapping[str, Mapping[str, Any]], colours: Mapping[str, str]) -> Drawing:
    """Where within a pixel the centroids lie: flat is good; a peak means that they prefer a place (pixel locking)."""
    drawing = new_drawing(1, 2, height=2.2)
    for camera, record in records.items():
        for ax, axis in zip(drawing.axes, "xy", strict=True):
            histogram = record["pixel_locking"][axis]
            counts, edges = (np.asarray(histogram[key], float) for key in ("counts", "edges"))
            if counts.sum():
                ax.plot(np.repeat(edges, 2)[1:-1], np.repeat(counts / counts.mean(), 2), colours[camera], label=camera)
    top = max((ax.bounds()[1][1] for ax in drawing.axes if ax.lines), default=1.1)
    for ax, axis in zip(drawing.axes, ("Xf", "Yf"), strict=True):
        ax.level(1.0, INK, dash="1 3")
        ax.xlabel, ax.ylim = f"{axis} within the pixel (px)", (0.0, top)
    first = drawing.axes[0]
    first.ylabel, first.legend = "share, times the mean", True
    return drawing


def worst_moments(crops: Sequence[Mapping[str, Any]], camera: str) -> Drawing:
    """Pieces of the picture around the targets in the worst samples, each with its flag."""
    drawing = new_drawing(1, len(crops), width=min(9.0, 1.5 * len(crops) + 0.4), height=1.9, title=camera)
    for ax, crop in zip(drawing.axes, crops, strict=True):
        picture = np.asarray(crop["picture"])
        height, width = picture.shape[:2]
        uri = grey_uri(picture, float(picture.min()), float(picture.max()))
        ax.pictures.append(Picture(uri, 0.0, width, 0.0, height))
        ax.xlim, ax.ylim, ax.y_down, ax.equal, ax.ticks = (0.0, width), (0.0, height), True, "box", False
        ax.title = f"frame {crop['frame']}\n{crop['target']}: {crop['flag'] or 'least contrast'}"
    return drawing


def clock_search(clocks: Mapping[str, Mapping[str, Any]], colours: Mapping[str, str]) -> Drawing:
    """The epipolar error against a camera's clock offset: the minimum is the estimate."""
    drawing = new_drawing(width=6, height=2.6)
    (ax,) = drawing.axes
    for camera, own in clocks.items():
        if own.get("offsets_s"):
            offsets = np.asarray(own["offsets_s"], float)
            ax.plot(1000 * offsets, np.array(own["error_px"], float), colours[camera], label=camera)
            ax.level(1000 * own["offset_s"], colours[camera], upright=True, dash="1 3")
    ax.xlabel, ax.ylabel, ax.legend = "offset of the camera's clock (ms)", "epipolar error (px rms)", True
    return drawing
