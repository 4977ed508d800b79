"""Curves over the runs of a campaign: response and phase over the period of the waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.figures.drawing import Drawing, new_drawing
from vidtrack.figures.style import PALETTE

MARKS = ("o", "s", "^", "D", "v", "x", "+", ".")

Point = Mapping[str, Any]
"""T (s), H; rao and phase_deg, each {value, half_width}; run."""


def response_curves(curves: Mapping[str, Sequence[Point]], unit: str, title: str) -> Drawing:
    """RAO with its 95 % bar and phase over period, a mark for each motion; a line joins each motion's points.

    curves   motion: its points; unit: of the ratio, for the axis
    """
    drawing = new_drawing(2, 1, height=2.4, shared=True, title=title)
    ratios, phases = drawing.axes
    for i, (name, points) in enumerate(curves.items()):
        own = sorted(points, key=lambda point: point["T"])
        T = [point["T"] for point in own]
        colour = PALETTE[i % len(PALETTE)]
        for ax, key in ((ratios, "rao"), (phases, "phase_deg")):
            value = [point[key]["value"] if point[key]["value"] is not None else float("nan") for point in own]
            width = [point[key].get("half_width") or 0.0 for point in own]
            if key == "phase_deg":  # a phase that is open has no place
                value = [v if w < 180 else float("nan") for v, w in zip(value, width, strict=True)]
            ax.plot(T, value, colour, width=0.9, mark=MARKS[i % len(MARKS)], size=6.0, label=name)
            ax.bars(T, value, width, colour)
    ratios.ylabel, ratios.ylim, ratios.legend = f"response over wave ({unit})", (0.0, float("nan")), True
    phases.ylabel, phases.xlabel = "phase lag (deg)", "period of the waves (s)"
    return drawing
