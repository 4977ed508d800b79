"""A recorder's clock from a lamp that switches: the recorder sampled its voltage, cameras saw its light.

A voltage is sampled at instants, a picture is the light of its whole exposure. The switching lies between the last
sample on one side of the middle level and the first on the other, anywhere in that step: its standard error is the
step over sqrt 12. What the camera adds is in `flash.light_changes`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.timing.agreement import NOT_ESTIMATED, Timing
from vidtrack.timing.flash import light_changes, timing_from_changes
from vidtrack.timing.resample import interval

HYSTERESIS = 0.25
"""Share of the signal's range about its middle that is neither on nor off."""

FEW_LEVELS = 6.0
"""A signal whose range is fewer than so many times its noise does not switch."""


class LampTiming(NamedTuple):
    """timing: of the recorder, its offset is that at its first time; rivals: other offsets that fit as well, s."""

    timing: Timing
    rivals: tuple[float, ...]


def switchings(t: ArrayLike, signal: ArrayLike) -> tuple[Array, Array, Array]:
    """Moments (m,), s, at which a sampled signal switched, +1 on or -1 off (m,), and their standard errors (m,), s.

    t (n,) s, rising; signal (n,), any unit, NaN where missing. Empty where it does not switch between two levels.
    """
    times, levels = np.asarray(t, float), np.asarray(signal, float)
    good = np.isfinite(times) & np.isfinite(levels)
    times, levels = times[good], levels[good]
    nothing = np.zeros(0), np.zeros(0), np.zeros(0)
    if times.size < 4:
        return nothing
    low, high = np.percentile(levels, (0.5, 99.5))
    if np.mean(levels > (low + high) / 2) in (0.0, 1.0):  # a pulse shorter than the percentiles
        low, high = levels.min(), levels.max()
    noise = 1.4826 * float(np.median(np.abs(np.diff(levels)))) / np.sqrt(2)
    if not high - low > FEW_LEVELS * noise:
        return nothing
    middle, half = (low + high) / 2, HYSTERESIS * (high - low) / 2
    state = np.where(levels > middle + half, 1, np.where(levels < middle - half, -1, 0))
    known = np.flatnonzero(state)
    turns = np.flatnonzero(np.diff(state[known]))
    before, after = known[turns], known[turns + 1]
    width = times[after] - times[before]
    return (times[before] + times[after]) / 2, state[after].astype(float), width / np.sqrt(12)


def timing_from_lamp(
    t_camera: ArrayLike, level: ArrayLike, t_recorder: ArrayLike, signal: ArrayLike, *, shutter: float | None = None
) -> LampTiming:
    """The recorder's clock that makes the switchings of its signal fall on those of the light that a camera saw.

    t_camera, level     s and mean grey level of each picture, as for `light_changes`; shutter likewise
    t_recorder, signal  s and the sampled voltage of the lamp, or whatever switches with it, either way round
    """
    seen, said = light_changes(t_camera, level, shutter=shutter), switchings(t_recorder, signal)
    if not seen[0].size or not said[0].size:
        return LampTiming(NOT_ESTIMATED._replace(of=max(seen[0].size, said[0].size)), ())
    slack = 1.05 * max(interval(t_camera), interval(t_recorder))
    start = float(np.asarray(t_recorder, float)[0])
    either = [(said[0], way * said[1], said[2]) for way in (1.0, -1.0)]  # a lamp may light where its voltage falls
    timings = [timing_from_changes(seen, own, slack=slack, start=start) for own in either]
    best = max(range(2), key=lambda k: (timings[k].n, -abs(timings[k].sd.offset_s) if timings[k].is_known else 0.0))
    # a recorder that drives the lamp itself switches it in step with its samples: then all errors are alike
    found = timings[best].doubted(interval(t_recorder) / np.sqrt(12))
    return LampTiming(found, _rivals(seen, either[best], slack, found, start) if found.is_known else ())


def _rivals(
    seen: tuple[Array, Array, Array], said: tuple[Array, Array, Array], slack: float, found: Timing, start: float
) -> tuple[float, ...]:
    """Offsets at which as many switchings fall on each other, farther than `slack` from the one that was found."""
    apart = (seen[0][:, None] - said[0])[np.sign(seen[1])[:, None] == np.sign(said[1])]
    counts = np.array([np.count_nonzero(np.abs(apart - one) < slack) for one in apart])
    at = found.clock.offset_s
    others = np.sort(apart[(counts >= found.n) & (np.abs(apart - at) > 3 * slack)])
    merged: list[float] = []
    for one in others.tolist():
        if not merged or one - merged[-1] > 3 * slack:
            merged.append(one)
    return tuple(merged)
