"""Longitudinal time code: from the sound on an audio track to the labels of frames, and when each began.

The signal turns over at the start of every bit, and in the middle of a 1; 80 bits make a word, one a frame. What
counts is only when it turns, so any level, polarity and speed will do:

    sound --level, smoothing--> zero crossings --local period--> half-bit grid --sync word--> words --chains--> labels

A word is accepted only if every one of its 80 bits begins with a turn, its digits are possible, and its number
follows from its neighbours' (`chained`): noise then loses words, but makes no wrong ones. Its start is placed by
a straight line through all its crossings, to a few microseconds.

Source: SMPTE ST 12-1, sections 9.2 to 9.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.timing.timecode import Parts, drops_of, frame_from_parts, nominal

Ints = NDArray[np.int64]

_SYNC = np.array([0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 1])
_SLOWEST, _FASTEST = 0.45 * 24, 2.2 * 30
"""Words a second at half speed and at twice, with something to spare."""


class Words(NamedTuple):
    """Words that were read; arrays of one length, in order of time.

    start   samples (or s, once placed), the beginning of the first bit: that of the frame which the word names
    period  samples (or s), how long the word lasted
    parts   hours, minutes, seconds, frames
    drop    the drop-frame flag
    user    the 32 user bits
    """

    start: Array
    period: Array
    parts: Parts
    drop: NDArray[np.bool_]
    user: NDArray[np.uint32]

    def where(self, chosen: NDArray[np.bool_]) -> Words:
        """Those words for which `chosen` (n,) is true."""
        parts = Parts(*(part[chosen] for part in self.parts))
        return Words(self.start[chosen], self.period[chosen], parts, self.drop[chosen], self.user[chosen])


def joined(stretches: Sequence[Words]) -> Words:
    """The words of several stretches, one after the other; empty where there is no stretch."""
    if not stretches:
        return _gathered(*_nothing())
    parts = Parts(*(np.concatenate(part) for part in zip(*(words.parts for words in stretches), strict=True)))
    start, period, drop, user = (
        np.concatenate([getattr(words, name) for words in stretches]) for name in ("start", "period", "drop", "user")
    )
    return Words(start, period, parts, drop, user)


def read_words(samples: ArrayLike, rate: float) -> Words:
    """The words of time code in a stretch of sound, each by itself.

    samples  (n,) of one channel, any unit
    rate     samples a second; 16,000 or more, 8,000 at single speed
    Stretches without code give no words. Words cut off by either end are not read.
    """
    samples = np.asarray(samples, np.float32)
    for step in (int(rate // 20_000), 1) if rate >= 40_000 else (1,):
        # half the samples do, unless the tape ran so fast that too few are left of half a bit
        thinned = samples[: samples.size // step * step].reshape(-1, step).mean(1)
        start, period, bits = _read(thinned, rate / step)
        if start.size and (step == 1 or np.median(period) > 160 * 3.5):
            return _gathered(start * step + (step - 1) / 2, period * step, bits)
    return _gathered(*_nothing())


def _read(samples: NDArray[np.float32], rate: float) -> tuple[Array, Array, NDArray[np.uint8]]:
    shortest, longest = rate / (160 * _FASTEST), rate / (160 * _SLOWEST)
    if samples.size < 160 * shortest or not np.any(samples):
        return _nothing()
    level = _levelled(samples, longest)
    times = _crossings(_smoothed(level, 0.6 * shortest), 0.4)
    half = _local_half(np.diff(times), shortest, longest)
    if half.size == 0:
        return _nothing()
    # once more, now that the time over which the sign holds is known: noise averages out over most of it
    times = _crossings(_smoothed(level, 0.7 * float(np.median(half))), 0.4)
    return _words(times, _local_half(np.diff(times), shortest, longest))


def _nothing() -> tuple[Array, Array, NDArray[np.uint8]]:
    return np.empty(0), np.empty(0), np.empty((0, 64), np.uint8)


def _boxcar(x: Array, width: int) -> Array:
    """The mean over `width` (odd) samples about each; the ends are held."""
    total = np.cumsum(np.pad(x, (width // 2 + 1, width // 2), mode="edge"))
    return np.asarray((total[width:] - total[:-width]) / width)


def _smoothed(x: Array, width: float) -> Array:
    odd = 2 * int(width / 2) + 1
    return _boxcar(x, odd) if odd > 1 else x


def _levelled(samples: NDArray[np.float32], longest: float) -> Array:
    """The sound without its slow part (hum, offset; taken off twice), brought to a level of about 1 all along."""
    x: Array = samples.astype(float)
    for _ in range(2):
        x = x - _boxcar(x, 2 * int(4 * longest) + 1)
    about = _boxcar(np.abs(x), 2 * int(80 * longest) + 1)
    return x / np.maximum(about, 0.02 * float(about.max()) + 1e-12)


def _crossings(x: Array, hysteresis: float) -> Array:
    """When x turns over, samples, between samples by a straight line; wiggles below `hysteresis` do not count."""
    sure = np.flatnonzero(np.abs(x) > hysteresis)
    side = x[sure] > 0
    turned = np.flatnonzero(side[1:] != side[:-1]) + 1
    positive = x > 0
    changes = np.flatnonzero(positive[1:] != positive[:-1])
    last = changes[np.searchsorted(changes, sure[turned]) - 1]  # the last change of sign before it was sure
    return np.asarray(last + x[last] / (x[last] - x[last + 1]), float)


def _local_half(intervals: Array, shortest: float, longest: float, block: int = 120) -> Array:
    """The local length of half a bit for every interval, samples; empty where there is nothing like time code.

    Intervals are one or two halves long. The sync word alone makes a quarter of them short ones, so the short ones
    begin below the 15th percentile of any word's worth; their median is the half.
    """
    possible = (intervals > 0.7 * shortest) & (intervals < 2.5 * longest)
    if possible.sum() < block:
        return np.empty(0)
    kept = intervals[possible]
    blocks = kept[: len(kept) // block * block].reshape(-1, block)
    low = np.quantile(blocks, 0.12, axis=1, keepdims=True)
    short = np.where(blocks < 1.45 * low, blocks, np.nan)
    long = np.where((blocks >= 1.45 * low) & (blocks < 2.6 * low), blocks / 2, np.nan)
    half = np.nanmedian(np.concatenate([short, long], axis=1), axis=1)
    centre = np.flatnonzero(possible)[: len(blocks) * block].reshape(-1, block)[:, block // 2]
    if len(half) >= 3:  # a block of noise between two good ones follows them
        edge = np.concatenate([half[:1], half, half[-1:]])
        half = np.median([edge[:-2], half, edge[2:]], axis=0)
    return np.asarray(np.interp(np.arange(len(intervals)), centre, half))


def _words(times: Array, half: Array) -> tuple[Array, Array, NDArray[np.uint8]]:
    """Starts, periods and the first 64 bits of every stretch of the half-bit grid that is a word."""
    if half.size == 0:
        return _nothing()
    ratio = np.diff(times) / half
    steps = np.clip(np.rint(ratio), 1, 4).astype(np.int64)
    grid = np.concatenate([[0], np.cumsum(steps)])
    turns = np.zeros(grid[-1] + 1, np.uint8)
    turns[grid] = 1
    bad = np.concatenate([[0], np.cumsum((np.abs(ratio - steps) > 0.4) | (steps > 2))])

    pattern = np.ones(32, np.uint8)
    pattern[1::2] = _SYNC
    sync = _found(turns, pattern)
    begin = sync[sync >= 128] - 128
    begin = begin[turns[begin[:, None] + np.arange(0, 160, 2)].all(1)] if begin.size else begin
    first, last = np.searchsorted(grid, begin), np.searchsorted(grid, begin + 159, side="right") - 1
    last = np.minimum(last + 1, len(grid) - 1)  # the turn that ends the word, where there is one
    clean = bad[last] == bad[first]
    begin, first, last = begin[clean], first[clean], last[clean]
    start, slope = _lines(grid, times, first, last, begin)
    return start, 160 * slope, turns[begin[:, None] + np.arange(1, 129, 2)]


def _found(turns: NDArray[np.uint8], pattern: NDArray[np.uint8]) -> Ints:
    n = len(turns) - len(pattern) + 1
    if n <= 0:
        return np.empty(0, np.int64)
    alike = np.ones(n, bool)
    for at, wanted in enumerate(pattern):
        alike &= turns[at : at + n] == wanted
    return np.flatnonzero(alike)


def _lines(grid: Ints, times: Array, first: Ints, last: Ints, begin: Ints) -> tuple[Array, Array]:
    """Where the line times = start + slope (grid - begin), least squares over crossings first to last, begins."""
    mean = (times[-1] - times[0]) / max(grid[-1] - grid[0], 1)
    g = grid.astype(float)
    rest = times - mean * g  # what is left is small, so that sums of products keep their digits
    sums = [np.concatenate([[0], np.cumsum(part)]) for part in (np.ones(len(g)), g, rest, g * g, g * rest)]
    n, sg, sr, sgg, sgr = (total[last + 1] - total[first] for total in sums)
    slope = (n * sgr - sg * sr) / np.maximum(n * sgg - sg * sg, 1e-9)
    at = (sr - slope * sg) / np.maximum(n, 1) + slope * begin
    return at + mean * begin, slope + mean


def _gathered(start: Array, period: Array, bits: NDArray[np.uint8]) -> Words:
    """Words with possible digits."""

    def number(at: int, width: int) -> Ints:
        return np.asarray(bits[:, at : at + width] @ (1 << np.arange(width)), np.int64)

    units = [number(at, 4) for at in (48, 32, 16, 0)]
    tens = [number(56, 2), number(40, 3), number(24, 3), number(8, 2)]
    h, m, s, f = (10 * ten + unit for ten, unit in zip(tens, units, strict=True))
    good = (h < 24) & (m < 60) & (s < 60) & (f < 30) & np.all([unit < 10 for unit in units], axis=0)
    user = sum(number(4 + 8 * group, 4) << (4 * group) for group in range(8))
    return Words(
        start[good],
        period[good],
        Parts(h[good], m[good], s[good], f[good]),
        bits[good, 10] == 1,
        np.asarray(user, np.int64)[good].astype(np.uint32),
    )


class Reading(NamedTuple):
    """Time code along a recording.

    time     (n,) s, when each accepted word began; rising
    frame    (n,) the frames since midnight that the words name
    piece    (n,) which unbroken run of code each belongs to: 0, 1, ...; the code jumps between them
    rate     exact frames of code a second; drop whether they are counted in drop-frame
    speed    words a second over rate: 1 for a recording played as it was made
    dropouts (s from, s to, words missing) of each gap that was bridged, because the words behind it follow on
    refused  words that were read but follow from no neighbour, and are left out
    """

    time: Array
    frame: Ints
    piece: Ints
    rate: Fraction
    drop: bool
    speed: float
    dropouts: tuple[tuple[float, float, int], ...]
    refused: int


def code_rate(words: Words, seconds_per_sample: float, video_rate: Fraction | None = None) -> tuple[Fraction, bool]:
    """The exact rate of the code in some words, and whether it is drop-frame.

    How many frames a second has is given by the label after which the seconds turn; in less than a second of code,
    by how fast words come. 1000/1001 of that when the words come so slowly, or when they are drop-frame; at another
    speed than 1, when `video_rate` is of that kind.
    """
    drop = bool(np.mean(words.drop) > 0.5)
    coming = 1 / (float(np.median(words.period)) * seconds_per_sample)
    follows = np.diff(words.start) < 1.5 * words.period[:-1]
    turn = words.parts.frames[:-1][follows & (words.parts.frames[1:] == 0) & (words.parts.frames[:-1] > 0)] + 1
    turn = turn[np.isin(turn, (24, 25, 30))]
    n = int(np.bincount(turn).argmax()) if turn.size else min((24, 25, 30), key=lambda base: abs(base - coming))
    if not turn.size:
        n = max(n, min(base for base in (24, 25, 30) if base > words.parts.frames.max()))
    whole, less = Fraction(n), Fraction(n * 1000, 1001)
    if n == 30 and drop:
        return less, True
    if abs(coming / n - 1) < 0.0004:
        return whole, False
    if abs(coming / float(less) - 1) < 0.0004:
        return less, False
    ntsc = video_rate is not None and video_rate.denominator % 1001 == 0 and n != 25
    return (less if ntsc else whole), False


def chained(words: Words, time: ArrayLike, period: ArrayLike, rate: Fraction, drop: bool) -> Reading:
    """The words that follow from each other.

    time, period  (n,) s, of the words on the recording's own scale
    Two words follow on if their numbers differ by as many frames as words fit between them, within a third of one.
    Runs of fewer than three are left out; runs that follow on over a gap are one piece, the gap a dropout.
    """
    time, period = np.asarray(time, float), np.asarray(period, float)
    frame, valid = _numbers(words.parts, rate, drop)
    seen = np.flatnonzero(valid)
    runs = _runs(time[seen], frame[seen], period[seen])
    kept = seen[np.isin(runs, np.flatnonzero(np.bincount(runs, minlength=1) >= 3))] if seen.size else seen
    piece = _runs(time[kept], frame[kept], period[kept], far=True)
    # a piece that is only a stray run between two stretches of one piece would break it; runs of 3 are no accident
    gap = np.diff(frame[kept]) - 1
    bridged = np.flatnonzero((gap > 0) & (np.diff(piece) == 0))
    lost = tuple((float(time[kept[i]] + period[kept[i]]), float(time[kept[i + 1]]), int(gap[i])) for i in bridged)
    speed = float(1 / np.median(period[kept]) / float(rate)) if kept.size else np.nan
    return Reading(time[kept], frame[kept], piece, rate, drop, speed, lost, len(time) - len(kept))


def _runs(time: Array, frame: Ints, period: Array, *, far: bool = False) -> Ints:
    """A number for every word, the same as long as each follows from the one before it."""
    if time.size == 0:
        return np.empty(0, np.int64)
    apart = np.diff(time) / ((period[1:] + period[:-1]) / 2)
    step = np.diff(frame)
    tolerance = np.where(far & (step > 1), 0.33 + 0.001 * step, 0.33)  # tape speed wanders by a thousandth
    follows = (np.abs(apart - step) < np.minimum(tolerance, 0.49)) & (step > 0)
    return np.concatenate([[0], np.cumsum(~follows)])


def _numbers(parts: Parts, rate: Fraction, drop: bool) -> tuple[Ints, NDArray[np.bool_]]:
    """Frame numbers, and which labels exist at all at this rate."""
    n, d = nominal(rate), drops_of(rate, drop)
    valid = (parts.frames < n) & ~((parts.minutes % 10 > 0) & (parts.seconds == 0) & (parts.frames < d))
    safe = Parts(*(np.where(valid, part, 0) for part in parts))
    return frame_from_parts(safe, rate, drop), valid
