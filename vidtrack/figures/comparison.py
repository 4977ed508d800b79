"""The video against a contact sensor, as the thesis's figures 6.5 to 6.14 show it, and as Bland and Altman would."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.drawing import INK, Drawing, new_drawing
from vidtrack.figures.style import PALETTE

if TYPE_CHECKING:
    from pandas import DataFrame

VIDEO_COLOUR = PALETTE[0]


def comparisons(series: DataFrame, record: Mapping[str, Any], units: str) -> Iterator[tuple[str, Drawing]]:
    """All figures of one comparison, each with its caption.

    series   comparison.parquet: time_s, video, reference, reference_aligned, difference, difference_aligned
    record   comparison.json
    """
    axis = record["axis"]["asked"] if record["axis"]["asked"] != "auto" else "position along its line"
    lag = f"{record['lag_s']:.4f} s"
    yield "As recorded, and with the lag removed", records(series, axis, units, lag)
    yield "One second about the fastest motion, sample by sample", one_second(series, axis, units)
    yield "Reference minus video after the lag is removed", bland_altman(series, record, units)


def records(series: DataFrame, axis: str, units: str, lag: str) -> Drawing:
    """Both records as recorded (figure 6.5), with the lag removed (6.6), and what remains."""
    drawing = new_drawing(3, 1, height=1.8, shared=True, ratios=(1, 1, 0.7))
    recorded, aligned, rest = drawing.axes
    t = series["time_s"]
    for ax, column, title in (
        (recorded, "reference", "as recorded"),
        (aligned, "reference_aligned", f"reference moved {lag} later"),
    ):
        ax.plot(t, series[column], INK, width=1.8, label="reference")
        ax.plot(t, series["video"], VIDEO_COLOUR, label="video")
        ax.ylabel, ax.title = f"{axis} ({units})", title
    rest.plot(t, series["difference_aligned"], PALETTE[1], width=1.0)
    rest.level(0.0, "#999999")
    rest.ylabel = f"difference ({units})"
    rest.clock()
    recorded.x_first = aligned.x_first = rest.x_first
    recorded.legend = True
    return drawing


def one_second(series: DataFrame, axis: str, units: str) -> Drawing:
    """A second of both records about the fastest motion, with every sample (figure 6.14)."""
    t, video = series["time_s"].to_numpy(float), series["video"].to_numpy(float)
    known = np.isfinite(video)
    speed = np.abs(np.gradient(video[known], t[known])) if known.sum() > 2 else np.zeros(known.sum())
    middle = t[known][int(speed.argmax())] if speed.size else t[0]
    near = np.abs(t - middle) <= 0.5
    drawing = new_drawing(height=2.6)
    (ax,) = drawing.axes
    ax.plot(t[near], series["reference_aligned"].to_numpy(float)[near], INK, label="reference")
    ax.dots(t[near], video[near], VIDEO_COLOUR, mark="o", hollow=True, size=6.0, label="video")
    ax.clock()
    ax.ylabel, ax.legend = f"{axis} ({units})", True
    return drawing


def bland_altman(series: DataFrame, record: Mapping[str, Any], units: str) -> Drawing:
    """Reference against video, and their difference against their mean with its limits of agreement."""
    drawing = new_drawing(1, 2, height=3.2)
    left, right = drawing.axes
    video, reference = series["video"].to_numpy(float), series["reference_aligned"].to_numpy(float)
    left.dots(video, reference, VIDEO_COLOUR, size=3.5)
    ends = np.array([np.nanmin(video), np.nanmax(video)])
    after = record["after"]
    line = f"gain {after['gain']:.4f}, bias {after['bias']:.3f} {units}"
    left.plot(ends, after["gain"] * ends + after["bias"], INK, width=1.0, label=line)
    left.xlabel, left.ylabel = f"video ({units})", f"reference ({units})"
    right.dots(series["mean_aligned"], series["difference_aligned"], VIDEO_COLOUR, size=3.5)
    low, high = after["limits"]
    right.level(after["mean_difference"], label="mean difference")
    right.level(low, dash="5 4", label=f"limits of agreement {low:.3f} to {high:.3f}")
    right.level(high, dash="5 4")
    right.xlabel, right.ylabel = f"mean of both ({units})", f"reference minus video ({units})"
    left.legend = right.legend = True
    return drawing
