"""Times as people write them: seconds, SMPTE time code or ISO 8601, turned into seconds since midnight."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import date, datetime, time
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.timing.timecode import Timecode, frame_from_label, nominal

RATES = tuple(
    Fraction(r) for r in ("30000/1001", "30", "25", "24000/1001", "24", "60000/1001", "60", "50", "100", "120", "240")
)
_LABEL = re.compile(r"\d{1,2}:\d{1,2}:\d{1,2}[:;.,]\d{2,3}")
_HALF_A_CLOCK = re.compile(r"\d{1,2}:\d{2}(\.\d+)?")
FEWEST_LABELS = 60
"""Labels of a record that reach its highest frame number by then: of fewer it is open how far they count."""
DAY = 86400.0
FARTHEST_S = 36_000
"""s: a located sample may lie so far behind its run's first frame. Non-drop labels fall behind by 1 ms a second."""


class Counting(NamedTuple):
    """How a recording's time code counts.

    behind  s, to be added to a count of frames from the code's midnight: what non-drop labels at 29.97 have fallen
            behind a clock (TimeBase.behind); 0 for codes that keep up
    """

    rate: Fraction
    drop: bool
    behind: float = 0.0


class Times(NamedTuple):
    """seconds (n,), rising over midnight; how the cells were written: seconds, time code or ISO."""

    seconds: Array
    written: str


def counting_of(labels: Sequence[str], time_s: ArrayLike) -> Counting | None:
    """The rate and counting that turn the video's own labels into its times; None where no standard one does.

    labels  (n,) time codes; time_s (n,) s, of the same samples (a second field lies half a frame later)
    """
    given: Array = np.asarray(time_s, float)
    marked = [(str(label), t) for label, t in zip(labels, given, strict=True) if _LABEL.fullmatch(str(label))]
    if not marked:
        return None
    marked = [marked[i] for i in sorted({0, len(marked) // 2, len(marked) - 1})]
    drop = any(";" in label for label, _ in marked)
    found: list[tuple[float, Counting]] = []
    for rate in RATES:
        try:
            codes = [Timecode(int(frame_from_label(label, rate, drop)), rate, drop) for label, _ in marked]
        except ValueError:
            continue
        later = np.array([t - float(code.seconds) for code, (_, t) in zip(codes, marked, strict=True)])
        least = behind = float(codes[0].clock - codes[0].seconds)
        if behind and 0 < (fitted := float(np.median(later))) - least < FARTHEST_S * 1e-3:
            behind = fitted  # read as a clock at the run's first frame, which may lie well before these labels
        found.append((float(np.abs(later - behind).max() * rate), Counting(rate, drop, behind)))
    # 30 and 29.97 differ by a frame after 33 s only: the last label is farthest and shows it best
    miss, likely = min(found, key=lambda one: one[0], default=(np.inf, None))
    return likely if miss < 0.75 else None


def seconds_from_cells(cells: Sequence[object], counting: Counting | None = None) -> Times:
    """Seconds of a column of cells that are all written in one way; NaN for empty cells.

    Numbers are seconds as they stand. 10:00:59:15 is a time code, and so is the thesis's 10:00:59.15 where every
    cell ends in two digits below the frame rate; else a point begins decimals. ISO dates count from the midnight that
    begins the first cell's day, by the clock as written there; where all state their time zone, true time is counted
    from that cell on, whatever the zone then is (summer time that ends).
    A clock that falls by more than half a day has passed midnight.
    Raises ValueError that names the cell (counted from 1) for anything else, or a time code without a known counting.
    """
    texts = ["" if c is None or c != c else str(c).strip() for c in cells]
    filled = [t for t in texts if t]
    if all(_is_number(t) for t in filled):
        return Times(_over_midnight(np.array([float(t) if t else np.nan for t in texts])), "seconds")
    if _are_labels(filled, counting):
        if counting is None:
            raise ValueError("it holds time codes, and the video has none that gives their frame rate")
        _refuse_another_rate(filled, counting)
        return Times(_over_midnight(_each(texts, lambda t: _label_seconds(t, counting))), "time code")
    if filled and all(_HALF_A_CLOCK.fullmatch(t) for t in filled):
        raise ValueError(f"{filled[0]!r} may be hours and minutes or minutes and seconds; write seconds, or 10:00:59.5")
    days: list[datetime] = []
    if _is_number(filled[0]):
        row, text = next((i, t) for i, t in enumerate(texts) if t and not _is_number(t))
        raise ValueError(f"row {row + 1} is {text!r}: no seconds as above it. Write all times in one way")
    return Times(_over_midnight(_each(texts, lambda t: _iso_seconds(t, days))), "ISO")


def _refuse_another_rate(texts: Sequence[str], counting: Counting) -> None:
    """ValueError where a record's labels never count as far as the video's do: they count at another rate."""
    frames = {int(re.split(r"[:;.,]", text)[-1]) for text in texts}
    top, reached = nominal(counting.rate), max(frames) + 1
    if top >= 48 and len(frames) >= FEWEST_LABELS // 3 and len(texts) >= FEWEST_LABELS and reached <= 0.6 * top:
        raise ValueError(
            f"its time codes count to frame {reached - 1} and the video's to {top - 1}: they are of another rate. "
            "Write seconds"
        )


def _is_number(text: str) -> bool:
    try:
        return "_" not in text and not math.isinf(float(text))
    except ValueError:
        return False


def _are_labels(texts: Sequence[str], counting: Counting | None) -> bool:
    if not all(_LABEL.fullmatch(t) for t in texts):
        return False
    if any(t[-3] in ":;" or t[-4] in ":;" for t in texts):
        return True
    top = nominal(counting.rate) if counting else 30
    return all(t[-3] in ".," and int(t[-2:]) < top for t in texts)


def _each(texts: Sequence[str], seconds: object) -> Array:
    values = np.full(len(texts), np.nan)
    for i, text in enumerate(texts):
        if text:
            try:
                values[i] = seconds(text)  # type: ignore[operator]
            except ValueError as problem:
                raise ValueError(f"row {i + 1} is {text!r}: {problem}") from None
    return values


def _label_seconds(text: str, counting: Counting) -> float:
    hours, rest = text.split(":", 1)
    frame = int(frame_from_label(f"{int(hours):02d}:{rest}", counting.rate, counting.drop))
    return float(frame / counting.rate) + counting.behind


def _iso_seconds(text: str, days: list[datetime]) -> float:
    """Seconds after the midnight that begins the day of the first moment, which `days` keeps."""
    text = text.replace(",", ".")
    text = f"0{text}" if text[1:2] == ":" else text
    try:
        moment = datetime.fromisoformat(text if ":" in text or "T" in text else "a date alone")
    except ValueError:
        try:
            clock = time.fromisoformat(text if ":" in text else "hours alone")
        except ValueError:
            raise ValueError("not seconds, time code (10:00:59:15) or ISO 8601 (2026-01-31T10:00:59.5)") from None
        moment = datetime.combine(days[0].date() if days else date(2000, 1, 1), clock)
    days[:] = days or [moment]
    first = days[0].replace(tzinfo=None)
    both = moment.tzinfo is not None and days[0].tzinfo is not None
    since = moment - days[0] if both else moment.replace(tzinfo=None) - first
    return (since + (first - datetime.combine(first.date(), time()))).total_seconds()


def _over_midnight(seconds: Array) -> Array:
    good = np.isfinite(seconds)
    steps = np.diff(seconds[good], prepend=seconds[good][:1])
    answer = seconds.copy()
    answer[good] += DAY * np.cumsum(steps < -DAY / 2)
    return answer


def regular(seconds: ArrayLike) -> Array | None:
    """The even clock behind times that were rounded until some coincide; None where there is none.

    Table 5.2 of the thesis prints 200 samples a second to 0.01 s: each time twice. An even clock that no
    printed time misses by more than one unit of its last digit is taken for the right one.
    """
    t: Array = np.asarray(seconds, float)
    if len(t) < 4 or not np.isfinite(t).all() or (np.diff(t) > 0).all() or (np.diff(t) < 0).any():
        return None
    steps = np.diff(t)
    unit = float(steps[steps > 0].min()) if (steps > 0).any() else np.nan
    index = np.arange(len(t))
    even: Array = np.polyval(np.polyfit(index, t - t[0], 1), index) + t[0]
    return even if np.abs(even - t).max() <= 1.001 * unit else None
