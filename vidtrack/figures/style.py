"""How every figure looks: one colour a camera, units on axes, grids behind the data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#A67C00", "#7F7F7F")
"""Okabe and Ito's colours, which colour-blind readers can distinguish too."""

AXIS_COLOURS = {"x": "#0072B2", "y": "#D55E00", "z": "#009E73"}
REFERENCE_COLOUR = "#444444"
REJECTED_COLOUR = "#B00020"


def over_picture(colour: str) -> str:
    """#rrggbb of the same hue, light enough to show on dark pictures."""
    parts = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    lift = max(0, 200 - max(parts))
    return "#" + "".join(f"{min(255, part + lift):02X}" for part in parts)


def camera_colours(cameras: Sequence[str]) -> dict[str, str]:
    """The colour of each camera, by its place in the config."""
    return {camera: PALETTE[i % len(PALETTE)] for i, camera in enumerate(cameras)}


def new_figure(
    rows: int = 1, columns: int = 1, *, width: float = 9.0, height: float = 3.0, **options: Any
) -> tuple[Figure, Any]:
    """A figure of rows x columns axes, `height` inches a row, made without a window system."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height * rows), layout="constrained", dpi=110)
    axes = figure.subplots(rows, columns, **options)
    for ax in figure.axes:
        ax.grid(True, color="#e2e2e2", linewidth=0.6)
        ax.set_axisbelow(True)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)
        ax.tick_params(labelsize=8)
    return figure, axes


def picture_axes(ax: Axes, width: float, height: float) -> None:
    """Frame buffer axes: px, Y downward, equal scales, the whole picture in view."""
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)
    ax.set_aspect("equal")
    ax.grid(False)
    ax.set_xlabel("Xf (px)", fontsize=8)
    ax.set_ylabel("Yf (px)", fontsize=8)


def legend(ax: Axes, **options: Any) -> None:
    """A legend of what the axes show; none where nothing is labelled."""
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.legend(handles, labels, **options)


def magnification(lengths: Any, target: float) -> float:
    """The round number (1, 2, 5 times a power of ten) that makes typical arrows about `target` long."""
    import numpy as np

    lengths = np.asarray(lengths, float)
    lengths = lengths[np.isfinite(lengths)]
    typical = float(np.median(lengths)) if lengths.size else 0.0
    if not typical > 0:
        return 1.0
    wanted = target / typical
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(1.0, power * max(s for s in (1, 2, 5) if s * power <= wanted * 1.0001)))
