"""SMPTE time code: whole frames counted from midnight, and the labels HH:MM:SS:FF that people read.

A count is exact: frame n begins n / rate seconds after the code's midnight, where rate is a Fraction
(30000/1001, never 29.97). A label is the same count written with the nominal rate (30): at 30000/1001 the
labels fall 3.6 s an hour behind the clock, and drop-frame counting leaves out the labels ;00 and ;01 of every
minute but each tenth (;00 to ;03 at 59.94), so that they stay within 0.15 s of it all day. No frame
of the picture is dropped, only labels.

Source: SMPTE ST 12-1. A `;` before the frames means drop-frame; the thesis writes 10:00:59.15.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Ints = NDArray[np.int64]

_LABEL = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})([:;.,])(\d{1,3})")


class Parts(NamedTuple):
    """The parts of labels, int64 arrays of one shape."""

    hours: Ints
    minutes: Ints
    seconds: Ints
    frames: Ints


def nominal(rate: Fraction) -> int:
    """How many labels a second of code has: the rate rounded to a whole number (30 for 30000/1001)."""
    return round(rate)


def exact_rate(rate: Fraction | float | str) -> Fraction:
    """The exact rate that a rounded one stands for: 29.97 and 2997/100 are 30000/1001, 23.976 is 24000/1001.

    A rate within 200 parts in a million of n or n 1000/1001 (n whole) is taken for it, the nearer of the two; any other
    is kept as it is. Below 500 the two families lie 1000 parts in a million apart; 23.98 is 166 off.
    Raises ValueError unless the rate is positive.
    """
    given = Fraction(rate) if not isinstance(rate, float) else Fraction(rate).limit_denominator(1_000_000)
    if given <= 0:
        raise ValueError(f"a frame rate must be positive, not {rate}")
    whole, ntsc = Fraction(round(given)), Fraction(round(given * Fraction(1001, 1000)) * 1000, 1001)
    nearest = min(whole, ntsc, key=lambda candidate: abs(given - candidate))
    return nearest if nearest and abs(given / nearest - 1) < Fraction(200, 1_000_000) else given


def drops_of(rate: Fraction, drop: bool) -> int:
    """How many labels each minute but the tenth leaves out: 2 at 29.97, 4 at 59.94, 0 without drop-frame.

    Raises ValueError where drop-frame counting is not defined: any rate but 30 n 1000/1001.
    """
    if not drop:
        return 0
    n = nominal(rate)
    if n % 30 or rate != Fraction(n * 1000, 1001):
        raise ValueError(f"drop-frame counting is defined for 29.97 and its multiples, not for {float(rate):.6g}")
    return n // 15


def frames_in_day(rate: Fraction, drop: bool = False) -> int:
    """How many labels a day of code has: 2,589,408 at 29.97 drop-frame, 2,592,000 without."""
    return 86400 * nominal(rate) - drops_of(rate, drop) * (1440 - 144)


def parts_from_frame(frame: ArrayLike, rate: Fraction, drop: bool = False) -> Parts:
    """The parts of the labels of whole frame numbers since midnight; numbers beyond a day wrap.

    In drop-frame, ten minutes hold 10*60*n - 9*d labels; a minute after the first of them 60*n - d.
    """
    n, d = nominal(rate), drops_of(rate, drop)
    count = np.asarray(frame, np.int64) % frames_in_day(rate, drop)
    if d:
        tens, rest = np.divmod(count, 600 * n - 9 * d)
        minute = np.maximum(rest - d, 0) // (60 * n - d)
        count = count + d * (9 * tens + minute)
    seconds, frames = np.divmod(count, n)
    minutes, seconds = np.divmod(seconds, 60)
    hours, minutes = np.divmod(minutes, 60)
    return Parts(hours, minutes, seconds, frames)


def frame_from_parts(parts: Parts, rate: Fraction, drop: bool = False) -> Ints:
    """Whole frame numbers since midnight of the parts of labels.

    Raises ValueError, naming the first one, for a label that no frame has: 24:00:00:00, frame 30 of 30, a second
    of 60, or in drop-frame one of those left out.
    """
    h, m, s, f = np.broadcast_arrays(*(np.asarray(part, np.int64) for part in parts))
    n, d = nominal(rate), drops_of(rate, drop)
    wrong = (h < 0) | (h > 23) | (m < 0) | (m > 59) | (s < 0) | (s > 59) | (f < 0) | (f >= n)
    left_out = (m % 10 > 0) & (s == 0) & (f < d)
    if np.any(wrong | left_out):
        first = np.flatnonzero(wrong | left_out)[0]
        text = "{:02d}:{:02d}:{:02d}".format(*(part.flat[first] for part in (h, m, s)))
        text += f"{';' if d else ':'}{f.flat[first]:02d}"
        why = f" at {n} frames a second" if wrong.flat[first] else f": drop-frame leaves out {d} labels of this minute"
        raise ValueError(f"time code {text} does not exist{why}")
    minutes = 60 * h + m
    return np.asarray((minutes * 60 + s) * n + f - d * (minutes - minutes // 10))


def label_from_frame(frame: ArrayLike, rate: Fraction, drop: bool = False) -> NDArray[np.str_]:
    """Labels, a string array of the shape of `frame`, of whole frame numbers since midnight.

    The separator before the frames is `;` in drop-frame and `:` otherwise. At 100 and more frames a second the
    frames take three digits.
    """
    parts = parts_from_frame(frame, rate, drop)
    width = max(2, len(str(nominal(rate) - 1)))
    shape = parts.hours.shape
    text = np.empty((*shape, 9 + width), np.uint32)
    for column, part in zip((0, 3, 6), parts[:3], strict=True):
        text[..., column] = 48 + part // 10
        text[..., column + 1] = 48 + part % 10
        text[..., column + 2] = ord(":")
    if drop:
        text[..., 8] = ord(";")
    for place in range(width):
        text[..., 9 + place] = 48 + parts.frames // 10 ** (width - 1 - place) % 10
    return np.ascontiguousarray(text).view(f"<U{9 + width}")[..., 0]


def frame_from_label(label: ArrayLike, rate: Fraction, drop: bool = False) -> Ints:
    """Whole frame numbers since midnight of labels, an array of strings that are all of one width.

    The separators are not looked at: `drop` says how to count. Raises ValueError for text that is no label.
    """
    text = np.atleast_1d(np.asarray(label, np.str_))
    width = text.dtype.itemsize // 4
    codes = np.ascontiguousarray(text).view(np.uint32).reshape(*text.shape, width)
    digits = codes.astype(np.int64) - 48
    places = [0, 1, 3, 4, 6, 7, *range(9, width)]
    good = width >= 11 and bool(np.all((digits[..., places] >= 0) & (digits[..., places] <= 9)))
    if not good or not np.isin(codes[..., [2, 5, 8]], [ord(c) for c in ":;.,"]).all():
        raise ValueError(f"not all of these are time codes like 10:00:59:15: {text.flat[0]!s} ...")
    h, m, s = (digits[..., i] * 10 + digits[..., i + 1] for i in (0, 3, 6))
    f = digits[..., 9:] @ 10 ** np.arange(width - 10, -1, -1)
    return frame_from_parts(Parts(h, m, s, f), rate, drop).reshape(np.shape(label))


@dataclass(frozen=True, order=True)
class Timecode:
    """One time code: a whole frame number since midnight, counted at an exact rate.

    frame  frames since midnight; may exceed a day, so that a recording can run over midnight
    rate   Fraction, frames a second
    drop   whether the labels are counted in drop-frame
    """

    frame: int
    rate: Fraction
    drop: bool = False

    def __post_init__(self) -> None:
        drops_of(self.rate, self.drop)

    def __str__(self) -> str:
        return str(label_from_frame(self.frame, self.rate, self.drop))

    def __add__(self, frames: int) -> Timecode:
        return Timecode(self.frame + frames, self.rate, self.drop)

    @property
    def seconds(self) -> Fraction:
        """Exact seconds since the code's midnight, when it showed 00:00:00:00 or would have."""
        return self.frame / self.rate

    @property
    def clock(self) -> Fraction:
        """Seconds since midnight that the label shows, read as the time of a clock.

        Non-drop labels at 29.97 run 3.6 s an hour behind a clock: they were set by one when the recording was made,
        so that they show its time then, not the time since a midnight. Other codes keep up: there it is `seconds`.
        """
        return self.seconds if self.drop else Fraction(self.frame, nominal(self.rate))


def parse(text: str, rate: Fraction, drop: bool | None = None) -> Timecode:
    """The time code that a person wrote: 10:00:59:15, 10:00:59;15 (drop-frame) or the thesis's 10:00:59.15.

    drop  None takes the separator's word, `;` for drop-frame; a run that is known to be drop-frame (True) also
          takes `:`, as many write it
    Raises ValueError that names the text for anything else, for a `;` where drop is False or the rate has no
    drop-frame, and for labels that no frame has.
    """
    found = _LABEL.fullmatch(text.strip())
    if not found:
        raise ValueError(f"{text!r} is not a time code. Write hours, minutes, seconds and frames like 10:00:59:15")
    h, m, s, separator, f = found.groups()
    if separator == ";" and drop is False:
        raise ValueError(f"{text!r} is a drop-frame time code (;) but the recording does not count in drop-frame")
    counted = (separator == ";") if drop is None else drop
    parts = Parts(*(np.int64(part) for part in (h, m, s, f)))  # type: ignore[arg-type]
    return Timecode(int(frame_from_parts(parts, rate, counted)), rate, counted)
