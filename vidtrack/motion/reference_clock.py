"""The times of a contact sensor's record: what brings them to the video's, and how finely they are written."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.motion.lag import FEWEST, Lag, find_lag

NON_DROP = 1.001
"""Seconds of a clock for one of a label, where non-drop labels are counted at 29.97."""
HOUR_S, DAY_S = 3600.0, 86400.0
SINCE_START_S = 3600.0
"""Times below it, where the other record's lie above, seem to count from a start."""


def no_common_time(tr: Array, t: Array) -> tuple[str, str]:
    """Records that share no time: what would bring them together."""
    text = (
        f"the reference runs from {tr[0]:.3f} to {tr[-1]:.3f} s and the video's samples from {t[0]:.3f} to "
        f"{t[-1]:.3f} s: they share no time, and nothing is compared"
    )
    for ratio in (1 / NON_DROP, NON_DROP):  # non-drop labels at 29.97: counted from midnight, or read as a clock
        later = (tr[0] + tr[-1]) / 2 * (ratio - 1)
        if abs(later) > 1 and max(t[0], tr[0] + later) < min(t[-1], tr[-1] + later):
            text += f". One of them counts non-drop frames from midnight: {later:+.3f} s bring them together"
            return text, f"Set reference.offset_s: {later:.3f}."
    if (counted := in_another_unit(tr, t)) is not None:
        return f"{text}. {counted}", IN_SECONDS
    if (other := _by_days_or_hours(tr, t)) is not None:
        later, why = other
        return f"{text}. {why}: {later:+.0f} s bring them together", f"Set reference.offset_s: {later:.0f}."
    if tr[0] < SINCE_START_S < t[0]:
        return text, "The reference seems to count from its own start: set reference.offset_s, or auto to correlate."
    if t[0] < SINCE_START_S < tr[0]:
        return text, "The video has no time code: set reference.offset_s: auto, or runs.<run>.start_timecode."
    return text, "Put both on one clock, or set reference.offset_s: auto to bring them together by their motion."


IN_SECONDS = "Write the reference's times in seconds."
UNITS_S = {"milliseconds": 1e-3, "microseconds": 1e-6, "minutes": 60.0, "hours": HOUR_S}


def in_another_unit(tr: Array, t: Array) -> str | None:
    """What the reference's times seem to count in, where they then lie within the video's; None where nothing fits.

    A spreadsheet counts days: its times of one clock second differ by 1/86400, and whole days stand before the point.
    """
    span = float(t[-1] - t[0])
    for unit, size in UNITS_S.items():
        first, last = float(tr[0]) * size, float(tr[-1]) * size
        later = DAY_S * round((t[0] + t[-1] - first - last) / 2 / DAY_S)  # some count from another date
        if span / 3 < last - first < 3 * span and max(t[0], first + later) < min(t[-1], last + later):
            return f"The reference seems to count in {unit}"
    clock = (tr[[0, -1]] % 1) * DAY_S
    if span / 3 < clock[1] - clock[0] < 3 * span and max(t[0], clock[0]) < min(t[-1], clock[1]):
        return "The reference seems to count in days, as spreadsheets do"
    return None


def too_sparse(tr: Array, t: Array) -> tuple[str, str] | None:
    """Words for a reference of one time, or of fewer samples in the video's time than a lag needs; None otherwise."""
    if len(tr) < 2:
        text = f"all samples of the reference have one time, {tr[0]:.6g} s: nothing is compared"
        return text, "Correct the column of times (reference.time): is it a date, or a column that was not filled in?"
    step = float(np.median(np.diff(tr)))
    if step * (FEWEST - 1) <= t[-1] - t[0]:
        return None
    text = f"the reference has a sample every {step:.6g} s, the video lasts {t[-1] - t[0]:.3f} s: nothing is compared"
    if (counted := in_another_unit(tr, t)) is not None:
        return f"{text}. {counted}", IN_SECONDS
    return text, "Correct the column of times (reference.time), or record the reference at a higher rate."


def _by_days_or_hours(tr: Array, t: Array) -> tuple[float, str] | None:
    """Whole days, whole hours, or both that make the records overlap, s, and what they mean; None where none does.

    The fewest hours are the likeliest. A record that starts at 0 counts from its own start and is of no zone.
    """
    if (tr[0] < SINCE_START_S) != (t[0] < SINCE_START_S):
        return None
    middle = float((t[0] + t[-1] - tr[0] - tr[-1]) / 2)
    days = DAY_S * round(middle / DAY_S)
    for zone in sorted(range(-14, 15), key=abs):
        later = days + HOUR_S * zone
        if not later or not max(t[0], tr[0] + later) < min(t[-1], tr[-1] + later):
            continue
        apart = f"{abs(days) // DAY_S:.0f} days" if abs(days) > DAY_S else "one day"
        hours = "one hour" if abs(zone) == 1 else f"{abs(zone)} hours"
        if not zone:
            return later, f"One of them is of another date, {apart} off"
        also = f", and of another date, {apart} off" if days else ""
        return later, f"One of them is in another time zone or summer time, {hours} off{also}"
    return None


def offset_by_correlation(tr: Array, r: Array, t: Array, video: Array) -> tuple[float, Finding]:
    """What is to be added to the reference's times for the records to correlate best."""
    start = float(t[0] - tr[0])
    lag = find_lag(tr + start, r, t, video)
    if not np.isfinite(lag.lag_s):
        text = "no offset was found at which reference and video correlate: one does not move, or they share little"
        return float("nan"), Finding("bad", "reference-offset-unknown", text, "Give reference.offset_s in seconds.")
    offset = start + lag.lag_s
    text = (
        f"the reference's times were moved by {offset:.4f} s, where it correlates best with the video "
        f"({lag.correlation:.3f}): the lag that remains says nothing of either clock"
    )
    if lag.others:
        others = ", ".join(f"{start + o:.3f}" for o in lag.others[:5])
        return offset, Finding(
            "doubtful", "reference-offset-ambiguous", f"{text}; {others} s do as well", "Give offset_s."
        )
    return offset, Finding("note", "reference-offset-found", text, "")


def with_rounding(lag: Lag, resolution: float) -> Lag:
    """The lag, less sure by what rounding of the reference's times hides: half a step either way."""
    half = resolution / 2
    return lag._replace(sd=float(np.hypot(lag.sd, resolution / np.sqrt(12))), low=lag.low - half, high=lag.high + half)


def resolution_of(written: Array, coincide: bool) -> float:
    """The step, s, to which times that coincide or are in whole seconds were rounded; 0 where they are exact."""
    for step in (1.0, 0.1, 0.01, 0.001):
        if np.allclose(written / step, np.round(written / step), rtol=0, atol=1e-6 / step):
            return step if coincide or step == 1.0 else 0.0
    return 0.0
