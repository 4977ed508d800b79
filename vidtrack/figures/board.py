"""A board at true scale, to be printed: its pattern, a ruler that checks the print, and what to write in board.yaml."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

MM = 1 / 25.4
EDGE_MM, FOOT_MM = 12.0, 30.0
"""White about the pattern, and room below it for the ruler and the words."""


def board_sheet(bitmap: NDArray[np.uint8], width_mm: float, height_mm: float, words: str) -> Figure:
    """A sheet of paper as a figure: save it as PDF and print it at 100 %.

    bitmap               of the pattern alone
    width_mm, height_mm  of the pattern
    """
    sheet = width_mm + 2 * EDGE_MM, height_mm + EDGE_MM + FOOT_MM
    figure = Figure(figsize=(sheet[0] * MM, sheet[1] * MM))
    at = [EDGE_MM / sheet[0], FOOT_MM / sheet[1], width_mm / sheet[0], height_mm / sheet[1]]
    pattern: Any = figure.add_axes((at[0], at[1], at[2], at[3]))
    pattern.imshow(bitmap, cmap="gray", vmin=0, vmax=255, interpolation="nearest", extent=(0, width_mm, 0, height_mm))
    pattern.set_axis_off()
    foot: Any = figure.add_axes((0, 0, 1, FOOT_MM / sheet[1]))
    foot.set_xlim(0, sheet[0])
    foot.set_ylim(0, FOOT_MM)
    foot.set_axis_off()
    length = 10 * int(min(100.0, width_mm) // 10)
    foot.plot([EDGE_MM, EDGE_MM + length], [16, 16], color="black", linewidth=0.5)
    for k in range(0, length + 1, 10):
        foot.plot([EDGE_MM + k] * 2, [16, 20 if k % 50 == 0 else 18], color="black", linewidth=0.5)
    foot.text(EDGE_MM, 11, f"{length} mm: measure it on the print", fontsize=7)
    foot.text(EDGE_MM, 5, words, fontsize=7)
    return figure
