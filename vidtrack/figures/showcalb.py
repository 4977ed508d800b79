"""The five pictures of the thesis's showcalb, and what is left: measured, projected, located and then projected."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.figures.style import PALETTE, magnification, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

NAMED = 3
"""Worst points whose tags are written beside their arrows."""


def showcalb(picture: np.ndarray[Any, Any], table: DataFrame, located_no_lens: Array, title: str) -> Figure:
    """Six panels over the camera's picture.

    picture          (h, w) grey
    table            rows of one camera of backprojection.parquet: tag, Xf, Yf, and with _projected, _no_distortion and
                     _from_located
    located_no_lens  (n, 2) px: the located points, projected without the lens's distortion
    """
    measured = table[["Xf", "Yf"]].to_numpy(float)
    projected = table[["Xf_projected", "Yf_projected"]].to_numpy(float)
    left, right, top, bottom = _part(picture.shape, np.concatenate([measured, projected]))
    figure, axes = new_figure(2, 3, width=11, height=11 / 3 * (bottom - top) / (right - left) + 0.45)
    undistorted = table[["Xf_no_distortion", "Yf_no_distortion"]].to_numpy(float)
    panels = (
        ("measured", measured, "#ffd400", "+"),
        ("projected from the survey", projected, PALETTE[5], "o"),
        ("the same without distortion", undistorted, PALETTE[5], "o"),
        ("located, then projected", table[["Xf_from_located", "Yf_from_located"]].to_numpy(float), PALETTE[3], "x"),
        ("the same without distortion", located_no_lens, PALETTE[3], "x"),
    )
    for ax in axes.ravel():
        ax.imshow(picture, cmap="gray", vmin=0, vmax=max(int(picture.max()), 1), interpolation="nearest")
        ax.set_xlim(left, right)
        ax.set_ylim(bottom, top)
        ax.grid(False)
        ax.set_xticks([])
        ax.set_yticks([])
    for ax, (name, points, colour, marker) in zip(axes.ravel(), panels, strict=False):
        ax.plot(*points.T, marker, mfc="none", color=colour, ms=6, mew=1.0, ls="none")
        ax.set_title(name, fontsize=9)
    _residuals(axes[1, 2], measured - projected, projected, [str(tag) for tag in table["tag"]], right - left)
    figure.suptitle(title, fontsize=10)
    return figure


def _part(shape: tuple[int, ...], points: Array) -> tuple[float, float, float, float]:
    """Left, right, top and bottom px of the part of the picture about the points."""
    known = points[np.isfinite(points).all(axis=1)]
    if not len(known):
        return -0.5, shape[1] - 0.5, -0.5, shape[0] - 0.5
    low, high = known.min(axis=0), known.max(axis=0)
    margin = max(0.08 * float((high - low).max()), 12.0)
    (left, top), (right, bottom) = np.maximum(low - margin, -0.5), np.minimum(high + margin, [shape[1], shape[0]])
    return float(left), float(right), float(top), float(bottom)


def _residuals(ax: Any, error: Array, start: Array, tags: list[str], width: float) -> None:
    length = np.hypot(*error.T)
    times = magnification(length, width / 25)
    good = np.isfinite(length)
    ax.quiver(
        *start[good].T,
        *(times * error[good]).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        color="#ffd400",
        width=0.004,
    )
    worst = [int(i) for i in np.argsort(-np.nan_to_num(length)) if good[i]][:NAMED]
    for i in worst:
        ax.annotate(tags[i], start[i], (5, 5), textcoords="offset points", color="#ff9d9d", fontsize=9)
    ax.set_xlabel("worst: " + ", ".join(f"{tags[i]} ({length[i]:.2g} px)" for i in worst), fontsize=8)
    ax.set_title(f"measured minus projected, {times:g} times", fontsize=9)
