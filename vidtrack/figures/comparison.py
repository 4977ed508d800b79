"""The video against a contact sensor, as the thesis's figures 6.5 to 6.14 show it, and as Bland and Altman would."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import PALETTE, REFERENCE_COLOUR, clock_axis, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

VIDEO_COLOUR = PALETTE[0]


def comparisons(series: DataFrame, record: Mapping[str, Any], units: str) -> Iterator[tuple[str, Figure]]:
    """All figures of one comparison, each with its caption.

    series   comparison.parquet: time_s, video, reference, reference_aligned, difference, difference_aligned
    record   comparison.json
    """
    axis = record["axis"]["asked"] if record["axis"]["asked"] != "auto" else "position along its line"
    lag = f"{record['lag_s']:.4f} s"
    yield "As recorded, and with the lag removed", records(series, axis, units, lag)
    yield "One second about the fastest motion, sample by sample", one_second(series, axis, units)
    yield "Reference minus video after the lag is removed", bland_altman(series, record, units)


def records(series: DataFrame, axis: str, units: str, lag: str) -> Figure:
    """Both records as recorded (figure 6.5), with the lag removed (6.6), and what remains."""
    figure, axes = new_figure(3, 1, height=1.8, sharex=True, height_ratios=(1, 1, 0.7))
    t = series["time_s"]
    for ax, column, title in (
        (axes[0], "reference", "as recorded"),
        (axes[1], "reference_aligned", f"reference moved {lag} later"),
    ):
        ax.plot(t, series[column], color=REFERENCE_COLOUR, lw=1.4, label="reference")
        ax.plot(t, series["video"], color=VIDEO_COLOUR, lw=0.9, label="video")
        ax.set_ylabel(f"{axis} ({units})", fontsize=8)
        ax.set_title(title, fontsize=8, loc="left")
    axes[2].plot(t, series["difference_aligned"], color=PALETTE[1], lw=0.8)
    axes[2].axhline(0, color="#999999", lw=0.6)
    axes[2].set_ylabel(f"difference ({units})", fontsize=8)
    clock_axis(axes[2])
    legend(axes[0], fontsize=7, ncols=2, loc="upper right")
    return figure


def one_second(series: DataFrame, axis: str, units: str) -> Figure:
    """A second of both records about the fastest motion, with every sample (figure 6.14)."""
    t, video = series["time_s"].to_numpy(float), series["video"].to_numpy(float)
    known = np.isfinite(video)
    speed = np.abs(np.gradient(video[known], t[known])) if known.sum() > 2 else np.zeros(known.sum())
    middle = t[known][int(speed.argmax())] if speed.size else t[0]
    near = np.abs(t - middle) <= 0.5
    figure, ax = new_figure(height=2.6)
    ax.plot(
        t[near], series["reference_aligned"].to_numpy(float)[near], "-", color=REFERENCE_COLOUR, lw=1, label="reference"
    )
    ax.plot(t[near], video[near], "o", mfc="none", color=VIDEO_COLOUR, ms=4, label="video")
    clock_axis(ax)
    ax.set_ylabel(f"{axis} ({units})", fontsize=8)
    legend(ax, fontsize=7)
    return figure


def bland_altman(series: DataFrame, record: Mapping[str, Any], units: str) -> Figure:
    """Reference against video, and their difference against their mean with its limits of agreement."""
    figure, (left, right) = new_figure(1, 2, height=3.2)
    video, reference = series["video"].to_numpy(float), series["reference_aligned"].to_numpy(float)
    left.plot(video, reference, ".", color=VIDEO_COLOUR, ms=3)
    ends = np.array([np.nanmin(video), np.nanmax(video)])
    after = record["after"]
    line = f"gain {after['gain']:.4f}, bias {after['bias']:.3f} {units}"
    left.plot(ends, after["gain"] * ends + after["bias"], color=REFERENCE_COLOUR, lw=0.8, label=line)
    left.set_xlabel(f"video ({units})", fontsize=8)
    left.set_ylabel(f"reference ({units})", fontsize=8)
    legend(left, fontsize=7)
    right.plot(series["mean_aligned"], series["difference_aligned"], ".", color=VIDEO_COLOUR, ms=3)
    low, high = after["limits"]
    for value, style, label in (
        (after["mean_difference"], "-", "mean difference"),
        (low, "--", f"limits of agreement {low:.3f} to {high:.3f}"),
        (high, "--", None),
    ):
        right.axhline(value, color=REFERENCE_COLOUR, lw=0.8, ls=style, label=label)
    right.set_xlabel(f"mean of both ({units})", fontsize=8)
    right.set_ylabel(f"reference minus video ({units})", fontsize=8)
    legend(right, fontsize=7)
    return figure
