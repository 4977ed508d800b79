"""What a contact sensor's record shows by itself: values that stand for none, and a clock of another rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding, Level
from vidtrack.motion.lag import FEWEST, Lag, long_run_covariance
from vidtrack.motion.smoothing import between, smooth

MISSING_MARKS = frozenset(
    {sign * mark for mark in (99.0, 999.0, 9999.0, 99999.0, 999.9, 9999.9, 1e30, 1e31) for sign in (1.0, -1.0)}
)
"""Values that loggers write for a missing one; taken for that only where they lie far from all others."""


@dataclass(frozen=True)
class RecordSettings:
    """When a value lies far off, and a clock's rate is another.

    far       times the range of the middle 90 % of the values by which a value lies off their median
    surely    standard deviations by which the lag changes over the records
    matters   s, the least change of the lag over the records
    ordinary  share by which good clocks differ: a note, no doubt
    alike     correlation below which two records do not show one motion
    scale     share by which a reference moves by another amount than the video: a note, a doubt
    """

    far: float = 20.0
    surely: float = 5.0
    matters: float = 0.001
    ordinary: float = 2e-4
    alike: float = 0.9
    scale: tuple[float, float] = (0.01, 0.05)


RECORD = RecordSettings()

ONE_UNIT = 2.0
"""Of two records of one length neither is so many times as long, unless they are in different units."""


def without_marks(r: Array) -> tuple[Array, list[str]]:
    """A sensor's values with NaN for marks such as -9999, and warnings of those and of others that lie far off."""
    good = np.isfinite(r)
    values = r[good]
    if len(values) < FEWEST:
        return r, []
    unmarked = values[~np.isin(values, list(MISSING_MARKS))]
    if len(unmarked) < FEWEST:
        return r, []
    low, middle, high = np.quantile(unmarked, (0.05, 0.5, 0.95))
    far = good & (np.abs(r - middle) > RECORD.far * (high - low)) & (high > low)
    marks = far & np.isin(r, list(MISSING_MARKS))
    warnings = []
    for mark in np.unique(r[marks]):
        warnings.append(f"{mark:g} stands {int((r == mark).sum())} times in the reference: taken for missing")
    rest = np.flatnonzero(far & ~marks)
    if len(rest):
        row = int(rest[0])
        warnings.append(
            f"the reference has values far from all others (number: {len(rest)}), the first in row {row + 1}: "
            f"{r[row]:g}; empty those cells if the sensor failed there"
        )
    return np.where(marks, np.nan, r), warnings


def clock_rate(tr: Array, r: Array, t: Array, video: Array, lag: Lag) -> Finding | None:
    """A finding where the lag of the video behind the reference changes along the records; None where it does not."""
    if not abs(lag.correlation) >= RECORD.alike / 2 or lag.n < 2 * FEWEST:
        return None
    x = smooth(tr, r)
    rate, middle, at = 0.0, float(np.mean(t)), lag.lag_s
    for _ in range(8):
        when = t - at - rate * (t - middle)
        model, slope = between(x, when), between(x, when, 1)
        good = np.isfinite(model) & np.isfinite(video)
        if good.sum() < 2 * FEWEST:
            return None
        line = np.stack([model[good], np.ones(int(good.sum()))], -1)
        gain = float(np.linalg.lstsq(line, video[good], rcond=None)[0][0])
        J = np.column_stack([-gain * slope[good], -gain * slope[good] * (t[good] - middle), line])
        rest = video[good] - line @ np.linalg.lstsq(line, video[good], rcond=None)[0]
        step = np.linalg.lstsq(J, rest, rcond=None)[0]
        at, rate = at + float(step[0]), rate + float(step[1])
    if not float(np.var(rest)) <= (1 - RECORD.alike**2) * float(np.var(video[good])):
        return None  # they do not show one motion at this rate either
    sd = float(np.sqrt(max(long_run_covariance(J, rest, t[good])[1, 1], 0.0)))
    span = float(t[good][-1] - t[good][0])
    if not (abs(rate) > RECORD.surely * sd and abs(rate) * span > max(RECORD.matters, 2 * lag.sd)):
        return None
    known = " (as 30 against 29.97 pictures a second do)" if abs(abs(rate) - 1e-3) < max(2e-4, 2 * sd) else ""
    text = (
        f"the lag changes by {1e3 * rate * span:.1f} ms over the {span:.1f} s of the records: the two clocks run at "
        f"rates that differ by {1e6 * rate:.0f} +- {1e6 * sd:.0f} parts in a million{known}; "
        "lag_s is that of the middle"
    )
    cure = "Correct the rate of the camera (runs.<run>.rate or cameras.<camera>.clock.rate_ppm) or of the reference."
    level: Level = "note" if abs(rate) < RECORD.ordinary else "doubtful"
    return Finding(level, "reference-clock-rate", text, cure)


def lag_warnings(lag: Lag, located: int) -> list[str]:
    """What makes a lag less than it seems."""
    if located < FEWEST:
        return [f"{located} samples were located: too few to compare with the reference"]
    if not np.isfinite(lag.lag_s):
        return ["no lag could be found: one record does not move, or too little of them is in common"]
    warnings = []
    if lag.others:
        others = ", ".join(f"{o:.3f}" for o in lag.others[:5])
        warnings.append(
            f"the motion repeats itself: lags of {others} s explain the records about as well. Take the one that both "
            "clocks allow; records that hold the beginning or the end of the motion have one alone."
        )
    if abs(lag.correlation) < RECORD.alike:
        warnings.append(
            f"even after the lag is removed the records correlate only to {lag.correlation:.2f}. Check column, axis "
            "and target of runs.<run>.reference, and whether it is of this run."
        )
    if lag.correlation < 0:
        warnings.append(
            "the reference counts in the opposite direction (gain below zero). Change the sign of its column, or see "
            "why the sensor counts so."
        )
    return warnings


def another_size(gain: float, axis: str, nearest: str) -> str:
    """What is said of a reference that moves `gain` times as far as the video along `axis`; nearest: the axis along
    which the target moves most.
    """
    text = f"the reference moves {gain:.4g} times as far as the video"
    if gain > 1 and axis in "xyz" and axis != nearest:
        return f"{text} along {axis}. The target moves along {nearest} above all: see runs.<run>.reference.axis."
    return f"{text}: are points.csv, reference.csv and `units` in one unit of length? Convert what is in another."


def scale(agreed: Mapping[str, float]) -> Finding | None:
    """A finding where the reference moves by another amount than the video, though in one unit; None where it does not.

    agreed   gain and gain_sd of the reference against the video after the lag is removed (`lag.Agreement`)
    """
    gain, sd = abs(agreed["gain"]), agreed["gain_sd"]
    off = abs(gain - 1)
    if not (off > RECORD.scale[0] and off > RECORD.surely * sd and 1 / ONE_UNIT < gain < ONE_UNIT):
        return None
    text = f"the reference moves {gain:.4g} +- {sd:.1g} times as far as the video, after the lag is removed"
    cure = (
        "Check the reference (limits reached, drop-outs, a filter, its own calibration), and the survey: that all axes "
        "are too long by one share no picture shows, but a reference does."
    )
    return Finding("doubtful" if off > RECORD.scale[1] else "note", "reference-scale", text, cure)
