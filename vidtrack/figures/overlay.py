"""Calibration points over the picture: measured, projected, and located and then projected (the thesis's showcalb)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import PALETTE, REJECTED_COLOUR, legend, magnification, new_figure, picture_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def overlay(picture: np.ndarray[Any, Any], points: DataFrame, backprojection: DataFrame, camera: str) -> Figure:
    """One camera's calibration points over its picture, with the reprojection errors as magnified arrows.

    picture          (h, w) grey
    points           the camera's points.parquet: tag, Xf, Yf, used, reason
    backprojection   rows of this camera: tag, Xf_projected, Yf_projected, Xf_from_located, Yf_from_located
    Rejected points are drawn hollow, with their tag and in the colour of a warning.
    """
    height, width = picture.shape[:2]
    figure, ax = new_figure(width=8, height=8 * height / width + 0.6)
    ax.imshow(picture, cmap="gray", vmin=0, vmax=max(int(picture.max()), 1), interpolation="nearest")
    picture_axes(ax, width, height)
    used = points[points["used"] & points["Xf"].notna()]
    out = points[~points["used"] & points["Xf"].notna()]
    ax.plot(used["Xf"], used["Yf"], "+", color="#ffd400", ms=8, mew=1.1, label=f"measured ({len(used)})")
    ax.plot(
        backprojection["Xf_projected"],
        backprojection["Yf_projected"],
        "o",
        mfc="none",
        mec=PALETTE[5],
        ms=9,
        mew=1.0,
        label="projected from the survey",
    )
    ax.plot(
        backprojection["Xf_from_located"],
        backprojection["Yf_from_located"],
        "x",
        color=PALETTE[3],
        ms=6,
        mew=1.0,
        label="located, then projected",
    )
    if len(out):
        label = f"rejected ({len(out)})"
        ax.plot(out["Xf"], out["Yf"], "s", mfc="none", mec=REJECTED_COLOUR, ms=12, mew=1.5, label=label)
        for tag, X, Y in zip(out["tag"], out["Xf"], out["Yf"], strict=True):
            ax.annotate(str(tag), (X, Y), (8, 8), textcoords="offset points", color="#ff8080", fontsize=8)
    _arrows(ax, backprojection, width)
    legend(ax, loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=4, fontsize=8, frameon=False)
    ax.set_title(f"{camera}: calibration points", fontsize=10)
    return figure


def _arrows(ax: Any, table: DataFrame, width: int) -> None:
    start = table[["Xf_projected", "Yf_projected"]].to_numpy(float)
    error = table[["Xf", "Yf"]].to_numpy(float) - start
    times = magnification(np.hypot(*error.T), width / 40)
    good = np.isfinite(error).all(1) & np.isfinite(start).all(1)
    ax.quiver(
        start[good, 0],
        start[good, 1],
        error[good, 0] * times,
        error[good, 1] * times,
        angles="xy",
        scale_units="xy",
        scale=1,
        color="#ffd400",
        width=0.0018,
    )
    rms = float(np.sqrt((error[good] ** 2).sum(1).mean())) if good.any() else float("nan")
    ax.text(
        0.01,
        0.985,
        f"arrows: measured minus projected, {times:g} times; rms {rms:.3f} px",
        transform=ax.transAxes,
        va="top",
        fontsize=8,
        color="#ffd400",
    )
