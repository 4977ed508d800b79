"""Curves over the runs of a campaign: response and phase over the period of the waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vidtrack.figures.style import PALETTE, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")

Point = Mapping[str, Any]
"""T (s), H; rao and phase_deg, each {value, half_width}; run."""


def response_curves(curves: Mapping[str, Sequence[Point]], unit: str, title: str) -> Figure:
    """RAO with its 95 % bar and phase over period, a mark for each motion; a line joins each motion's points.

    curves   motion: its points; unit: of the ratio, for the axis
    """
    figure, axes = new_figure(2, 1, height=2.4, sharex=True)
    for i, (name, points) in enumerate(curves.items()):
        own = sorted(points, key=lambda point: point["T"])
        T = [point["T"] for point in own]
        look: dict[str, Any] = {"color": PALETTE[i % len(PALETTE)], "marker": MARKS[i % len(MARKS)], "ms": 4, "lw": 0.8}
        for ax, key in zip(axes, ("rao", "phase_deg"), strict=True):
            value = [point[key]["value"] if point[key]["value"] is not None else float("nan") for point in own]
            width = [point[key].get("half_width") or 0.0 for point in own]
            ax.errorbar(T, value, yerr=width, capsize=2, label=name, **look)
    axes[0].set_ylabel(f"response over wave ({unit})", fontsize=8)
    axes[0].set_ylim(bottom=0)
    axes[1].set_ylabel("phase lag (deg)", fontsize=8)
    axes[1].set_xlabel("period of the waves (s)", fontsize=8)
    legend(axes[0], fontsize=8)
    figure.suptitle(title, fontsize=10)
    return figure
