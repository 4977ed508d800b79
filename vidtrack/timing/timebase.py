"""When a frame was: from its time stamp to whole frame numbers, time code labels and seconds since midnight.

A recording has two scales. Its time stamps (seconds after its first frame) say how its frames follow each other;
a time code, where there is one, says what the clock on the wall of the laboratory showed. A TimeBase joins them:

    base = video.info.time                     what the file itself says; video.time_source may find a better one
    time_s = base.seconds(times)               times (n,) s of frames, Frame.time; seconds since midnight: those that
                                               the first frame's label shows, then true elapsed ones
    time_s = base.seconds(times, fields=0.5)   the samples of the second fields, half a frame later
    label = base.labels(times)                 (n,) time code labels; "" where there is no time code

In constant-rate video a time stamp only says which whole frame it is: it is snapped to the grid of the exact
rate, so that stamps rounded to 1 ms (Matroska) do no harm and a lost frame leaves its gap. In variable-rate
video the stamps themselves are the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import zip_longest

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.timing.timecode import Timecode, exact_rate, label_from_frame, nominal, parse

TIME_LAPSE_CODE = Fraction(30)
"""ASSUME: labels a second on recordings whose rate no time code counts by, such as one picture in two seconds."""

COUNTED = tuple(Fraction(n) for n in (24, 25, 30, 48, 50, 60)) + tuple(Fraction(n * 1000, 1001) for n in (24, 30, 60))
"""Labels a second of the time code of film and television."""


LEAST_SCATTER = 0.002
"""Frames: time stamps that scatter by less are even ones."""


@dataclass(frozen=True)
class Anchor:
    """A frame whose time code is known.

    time   s, the frame's time stamp after the first frame
    frame  whole number of the code's frames since midnight
    phase  by how much of a code frame the picture comes later than the code's frame began, 0 where they are locked
    speed  seconds of code a second of the recording: 1 unless it is played slower or faster than it was made
    """

    time: float
    frame: int
    phase: float = 0.0
    speed: float = 1.0


@dataclass(frozen=True)
class TimeBase:
    """Seconds since midnight and labels of frames, from their time stamps.

    rate       exact frames of video a second
    code_rate  exact frames of time code a second; differs from rate where one label covers several frames
               (30 a second on 240 Hz video)
    drop       whether the code counts in drop-frame
    anchors    where the code is known, in order of time; each holds until the next. Empty: no time code, and
               seconds count from the first frame
    constant   whether the frames fall on the grid of `rate`
    source     where the time code came from, "none" where there is none
    tick       s by which time stamps are resolved; stamps that scatter by more are no rounded ones. 0: not known, and
               stamps near a grid are taken for its
    """

    rate: Fraction
    code_rate: Fraction
    drop: bool = False
    anchors: tuple[Anchor, ...] = ()
    constant: bool = True
    source: str = "none"
    tick: float = 0.0

    def seconds(self, times: ArrayLike, fields: ArrayLike = 0.0) -> Array:
        """Seconds since midnight of the code (without one: since the first frame), in the shape of `times`.

        times   s after the first frame, as Frame.time; NaN gives NaN
        fields  frames to add: 0 for the first field and for whole frames, 0.5 for the second field
        """
        times = np.asarray(times, float)
        if not self.anchors:
            return self._over_rate(self._elapsed(times) + np.asarray(fields, float))
        which = self._which(times)
        start, speed = self._column("time")[which], self._column("speed")[which]
        origin = np.array([float((a.frame + Fraction(a.phase)) * self.rate / self.code_rate) for a in self.anchors])
        counted = self._over_rate(origin[which] + speed * (self._elapsed(times - start) + np.asarray(fields, float)))
        return counted + float(self.behind)

    def labels(self, times: ArrayLike) -> NDArray[np.str_]:
        """Time code labels, a string array in the shape of `times`; "" where there is no code or time is NaN."""
        times = np.asarray(times, float)
        if not self.anchors:
            return np.full(times.shape, "", "<U1")
        known = np.isfinite(times)
        text = label_from_frame(self._code_frames(np.where(known, times, 0.0)), self.code_rate, self.drop)
        return np.where(known, text, "")

    def timecode(self, time: float) -> Timecode | None:
        """The time code of one frame, None where there is none."""
        if not self.anchors:
            return None
        return Timecode(int(self._code_frames(np.asarray(time, float))), self.code_rate, self.drop)

    @property
    def first(self) -> Timecode | None:
        """The time code of the first frame, None where there is none."""
        return Timecode(self.anchors[0].frame, self.code_rate, self.drop) if self.anchors else None

    @property
    def behind(self) -> Fraction:
        """s to add to a count of frames from the code's midnight: what its labels have fallen behind a clock, negative.

        Zero except for non-drop code at 29.97, 23.976 and 59.94 Hz: see `Timecode.clock`.
        """
        first = self.first
        return first.clock - first.seconds if first else Fraction(0)

    def time_of(self, code: Timecode) -> float:
        """The time stamp, s after the first frame, of the frame that bears a time code, for `start` and `end`.

        With several anchors, in the first stretch that holds it.
        """
        for anchor, following in zip_longest(self.anchors, self.anchors[1:]):
            shown = float((anchor.frame + Fraction(anchor.phase)) / self.code_rate)
            time = anchor.time + (float(code.seconds) - shown) / anchor.speed
            if following is None or time < following.time:
                return time
        raise ValueError("a recording without time code has no frame that bears one")

    def fitted(self, times: ArrayLike) -> TimeBase:
        """This time base on the grid that the time stamps themselves show, once they are all known.

        times  (n,) s after the first frame, in order; fewer than 3 change nothing
        Where no grid fits, the rate varies: `constant` is False and the stamps are taken as they are; so they are where
        they scatter about a grid by more than their rounding.
        """
        times = np.asarray(times, float)
        if len(times) < 3:
            return self
        rate = grid_rate(times, self.rate)
        if rate is None:
            return replace(self, constant=False)
        rounded = not scatters(times, rate, self.tick)
        return replace(self, rate=rate, code_rate=self.code_rate if self.anchors else rate, constant=rounded)

    def _column(self, name: str) -> Array:
        return np.array([getattr(anchor, name) for anchor in self.anchors], float)

    def _elapsed(self, dt: Array) -> Array:
        """Frames of video in dt, s: whole ones in constant-rate video."""
        frames: Array = dt * float(self.rate)
        return np.rint(frames) if self.constant else frames

    def _over_rate(self, frames: Array) -> Array:
        # one count of frames over the exact rate: cameras that share a label share the very same float
        return np.asarray(frames * self.rate.denominator / self.rate.numerator)

    def _which(self, times: Array) -> NDArray[np.intp]:
        # half a frame early: a rounded stamp must not fall before the anchor that it belongs to
        starts = self._column("time") - 0.5 / float(self.rate)
        return np.maximum(np.searchsorted(starts, np.nan_to_num(times), side="right") - 1, 0)

    def _code_frames(self, times: Array) -> NDArray[np.int64]:
        which = self._which(times)
        elapsed = self._elapsed(times - self._column("time")[which]) * self._column("speed")[which]
        first, phase = np.array([anchor.frame for anchor in self.anchors], np.int64), self._column("phase")[which]
        if self.rate == self.code_rate:
            return np.asarray(first[which] + np.rint(elapsed + np.clip(phase, -0.49, 0.49)), np.int64)
        return np.asarray(first[which] + np.floor(elapsed * float(self.code_rate / self.rate) + phase + 1e-3), np.int64)


def time_base(rate: Fraction, code: Timecode | None = None, *, source: str = "none", constant: bool = True) -> TimeBase:
    """The TimeBase of a recording whose first frame bears `code`; without one, seconds count from that frame."""
    if code is None:
        return TimeBase(rate, rate, constant=constant)
    anchors = (Anchor(0.0, code.frame),)
    return TimeBase(rate, code.rate, code.drop, anchors, constant, source)


def base_from_labels(
    labels: Mapping[str, str], rate: Fraction, bases: Mapping[str, Fraction] | None = None, shown: float = 0.0
) -> TimeBase:
    """The TimeBase by the first of several sources -> label of the first frame that can be read; none without one.

    bases  source -> labels a second, where that is known
    shown  s: the time of the first picture that could be decoded, whose own label gop, sei and dv give
    A group header (gop) that counts from zero is no time code: encoders write it unasked.
    """
    for source, label in labels.items():
        if source == "gop" and label.startswith("00:00:00"):
            continue
        try:
            code = parse(label, code_rate_of(rate, (bases or {}).get(source)))
            return time_base(rate, code + -frames_before(source, shown, code.rate), source=source)
        except ValueError:
            continue
    return time_base(rate)


def frames_before(source: str, shown: float, code_rate: Fraction) -> int:
    """By how many frames of the code the label of a source is later than the recording's first frame.

    A container's label is that of its first frame; one within the coded stream is that of its own picture, the first
    that could be decoded, `shown` s after the recording's first.
    """
    return round(shown * float(code_rate)) if source in ("gop", "sei", "dv") else 0


def code_rate_of(rate: Fraction, base: Fraction | None = None) -> Fraction:
    """The rate at which time code is counted on video of `rate`: the same up to 60 Hz, else the rate's 24, 25 or 30.

    base  labels a second that the recording itself states, rounded or exact: the whole part or multiple of `rate` that
          it stands for, or else itself (where lost frames have spoilt the rate)
    # ASSUME: SMPTE ST 12-1 ends at 60; high-speed recorders repeat a label (240 Hz: eight frames each).
    """
    if base is not None:
        part = rate / round(rate / base) if rate > base else rate * round(base / rate)
        return part if abs(part / base - 1) < Fraction(2, 1000) else exact_rate(base)
    n = nominal(rate)
    if n <= 60:
        whole = n and any(abs(rate / own - 1) < Fraction(2, 1000) for own in (n, Fraction(n * 1000, 1001)))
        return rate if whole else _counted(rate)
    for labels in (30, 25, 24):
        if n % labels == 0:
            return rate * labels / n
    return rate


def _counted(rate: Fraction) -> Fraction:
    """Labels a second beside video of a rate that is no whole number: a mean, or that of a time-lapse."""
    near = min(COUNTED, key=lambda labels: abs(rate / labels - 1))
    if abs(rate / near - 1) < Fraction(5, 100):
        return near
    multiples = (labels for labels in (30, 25, 24) if abs(labels / rate - round(labels / rate)) < Fraction(2, 1000))
    return Fraction(next(multiples, TIME_LAPSE_CODE))


def scatters(times: Array, rate: Fraction, tick: float) -> bool:
    """Whether time stamps (n,) s, resolved to `tick` s, lie off the grid of `rate` by more than rounding explains.

    Stamps that went through a coarser container are rounded to its ticks: to their common divisor.
    """
    if not tick:
        return False
    ticks = np.rint(np.diff(times) / tick).astype(np.int64)
    off = (times - times[0]) * float(rate)
    off = off - np.rint(off)
    off = np.abs(off - np.median(off)) / float(rate)
    return bool(off.max() > max(2 * tick * int(np.gcd.reduce(ticks)), LEAST_SCATTER / float(rate)))


def grid_rate(times: Array, stated: Fraction) -> Fraction | None:
    """The exact rate on whose grid time stamps (n,) s lie, every one within 0.3 frame; None where the rate varies.

    The stated rate, or a divisor of it (fields counted as frames), is tried first; then what a straight line through
    the stamps gives. Stamps rounded to 1 ms lie within 0.3 frame up to 500 frames a second. Gaps are no matter.
    """
    since = times - times[0]
    step = float(np.median(np.diff(times)))
    if not step > 0:
        return None
    n = np.concatenate([[0], np.cumsum(np.rint(np.diff(times) / step))])
    for _ in range(2):
        centred = n - n.mean()
        step = float((centred * since).sum() / max(float((centred * centred).sum()), 1.0)) or step
        n = np.rint(since / step)
    divided = stated / max(1, round(step * float(stated)))
    measured = exact_rate(Fraction(1 / step).limit_denominator(100_000))
    for rate in (divided, measured):
        off = since * float(rate)
        off = off - np.rint(off)
        if np.abs(off - np.median(off)).max() < 0.3:
            return rate
    return None
