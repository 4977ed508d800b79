"""When samples were taken; whether stamps that scatter are when pictures were taken, or when they arrived.

Some recorders write the moment of each exposure, which may itself be uneven; others write when a picture reached
them, late by turns, of a sensor that runs evenly. A target moves smoothly in the time in which its pictures were taken:
the residuals of a local cubic are compared under both clocks.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.timing.frame import Frame
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.state import SD_X, SD_Y, Rows, X, Y


@dataclass(frozen=True)
class Limits:
    """A track is compared in windows of `window` samples, by a polynomial of `degree`; of at least `windows` windows in
    all. The clock whose residuals are larger by the share `distinct` is refused.
    """

    window: int = 9
    degree: int = 3
    windows: int = 4
    distinct: float = 0.2


LIMITS = Limits()

VARIES = 1.2
"""Times that the longest steps between pictures are as long as the shortest where their rate is said to vary."""


class Moments(NamedTuple):
    """Per sample: the frame's number and time stamp (s), which field, and frames by which it is later."""

    frame: NDArray[np.int64]
    time: Array
    field: NDArray[np.object_]
    offset: Array


class Stamps:
    """Numbers and time stamps (s) of the frames that passed: a list of pairs would take seven times the memory."""

    def __init__(self) -> None:
        self.numbers, self.times = array("q"), array("d")

    def add(self, frames: Sequence[Frame]) -> None:
        """Take in some more."""
        self.numbers.extend(frame.index for frame in frames)
        self.times.extend(float(frame.time) for frame in frames)


def sample_moments(stamps: Stamps, order: str) -> Moments:
    """The samples of frames, one or two each, from their numbers and time stamps; order: frame, top or bottom."""
    fields = ["frame"] if order == "frame" else [order, "bottom" if order == "top" else "top"]
    each, frames = len(fields), len(stamps.numbers)
    return Moments(
        np.repeat(np.array(stamps.numbers, np.int64), each),
        np.repeat(np.array(stamps.times, float), each),
        np.array(fields * frames, object),
        np.tile(np.arange(each) / 2.0, frames),
    )


def chosen_clock(base: TimeBase, stamps: Array, rows: Rows, lines: int) -> tuple[TimeBase, list[Finding]]:
    """The clock of a recording whose pictures were tracked, and what to say where its stamps scatter.

    stamps  (frames,) s after the first picture
    rows    what was measured in `lines` samples a frame
    """
    clock, even = base.fitted(stamps), replace(base, tick=0.0).fitted(stamps)
    if not even.constant:
        return clock, _varying(stamps, clock)
    if clock.constant:
        return clock, []
    fields = np.tile(np.arange(lines) / lines, len(stamps))
    by_stamps, by_even = (
        _roughness(one.seconds(np.repeat(stamps, lines), fields) - one.seconds(stamps[:1])[0], rows)
        for one in (clock, even)
    )
    off = (stamps - stamps[0]) * float(even.rate)
    scatter = float(np.std(off - np.rint(off))) / float(even.rate)
    text = (
        f"time stamps scatter by {1000 * scatter:.2g} ms (rms) about an even rate of {float(even.rate):.6g} a second;"
    )
    if by_even < by_stamps / (1 + LIMITS.distinct):
        text += " the tracks are smoother at the even rate, which is used."
        return even, [Finding("note", "time-stamps-late", text, "")]
    if by_stamps < by_even / (1 + LIMITS.distinct):
        return clock, [
            Finding("note", "time-stamps-uneven", f"{text} the tracks are smoother by the stamps, which are used.", "")
        ]
    return clock, [
        Finding("note", "time-stamps-uneven", f"{text} the stamps are used: no track is fast enough to decide.", "")
    ]


def _varying(stamps: Array, clock: TimeBase) -> list[Finding]:
    """What is said of pictures that come at no even rate, as telephones take them where light is scarce."""
    few, many = 1000 * np.quantile(np.diff(stamps), (0.02, 0.98))
    if clock.constant or not many > VARIES * few:
        return []
    text = (
        f"pictures come at a rate that varies: {few:.3g} to {many:.3g} ms apart, mean {float(clock.rate):.5g} a second;"
        " the time stamps of the file are used, and nothing is located across more than 1.5 times the usual step."
    )
    cure = "Lock rate and exposure of the camera (telephones need an app for it), and give it more light."
    return [Finding("note", "picture-rate-varies", text, cure)]


def _roughness(time: Array, rows: Rows) -> float:
    """Mean square residual of the tracks, in sigmas, about local polynomials of time (samples,); NaN without any."""
    total, windows = 0.0, 0
    for target in range(rows.values.shape[2]):
        at = np.flatnonzero(np.isfinite(rows.values[X, :, target]))
        for begin in range(0, len(at) - LIMITS.window + 1, LIMITS.window):
            here = at[begin : begin + LIMITS.window]
            if here[-1] - here[0] > 2 * LIMITS.window:
                continue
            t = time[here] - time[here].mean()
            powers = np.vander(t / np.abs(t).max(), LIMITS.degree + 1)
            for axis, own_sd in ((X, SD_X), (Y, SD_Y)):
                sd = np.maximum(rows.values[own_sd, here, target], 1e-3)
                design, values = powers / sd[:, None], rows.values[axis, here, target] / sd
                off = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
                total += float((off**2).sum())
            windows += 1
    return total / windows if windows >= LIMITS.windows else np.nan
