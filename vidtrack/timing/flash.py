"""Two cameras' clocks from a light that both saw switched on or off.

A picture holds the mean light of its exposure. When the light changes during one, that picture lies between dark
and bright by just the share of the exposure that was left: with the shutter open all the time the moment is

    t = sum(d_k t_k) / sum(d_k),   d_k = L_k - L_(k-1) about the change, t_k when exposure k began

exact for a sudden change, whatever its phase in the picture. A flash much shorter than a picture falls into one and
shows no more than which.

Two things that no record states spoil it, and count in the error. What happens while the shutter is shut is not
seen: with a share S of the interval open, moments are off by (1 - S)/sqrt(12) of it (rms over all phases), and how
many changes fell within an exposure gives S. And a camera's gamma bends shares of light that are no small change.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.timing.agreement import NOT_ESTIMATED, Timing
from vidtrack.timing.clock import RATE_PRIOR_PPM, Clock
from vidtrack.timing.resample import interval

GAMMA = 0.45
"""ASSUME: a camera's levels go as the light, or as this power of it (ITU-R BT.709), or anything between."""

LEAST = 1.0
"""Grey levels: a smaller change of a whole picture's mean is a person passing by, not a lamp."""


def light_changes(t: ArrayLike, level: ArrayLike, *, shutter: float | None = 1.0) -> tuple[Array, Array, Array]:
    """Moments (m,), s, at which the light changed, by how much (m,), grey levels, and their standard errors (m,), s.

    t        (n,)  s, when each exposure began, rising
    level    (n,)  mean brightness of each picture; NaN where lost
    shutter  share of the interval during which the shutter is open: what happens while it is shut is known
             only to that extent. None: the camera is not known; what its shutter and gamma may do is in the errors
    A change counts from ten times the usual flicker and LEAST; a ramp over many pictures is a change at its middle.
    """
    times, light = np.asarray(t, float), np.asarray(level, float)
    times, light = times[np.isfinite(light)], light[np.isfinite(light)]
    if times.size < 4:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    d, step = np.diff(light), interval(times)
    flicker = max(1.4826 * float(np.median(np.abs(d - np.median(d)))), 1e-9)
    key = np.where(np.abs(d) > max(10 * flicker, LEAST), np.sign(d), 0)
    open_share = 1.0 if shutter is None else shutter
    runs = _runs(key)
    found: list[_Change] = []
    for i, (first, last) in enumerate(runs):
        if found and i and first == runs[i - 1][1] + 1:
            # back at once: a flash within that picture, and no more is known
            middle = found[-1].moment + 0.5 * open_share * step
            found[-1] = found[-1]._replace(moment=middle, sd=step / np.sqrt(12), between=-1)
            continue
        # the picture on either side may hold a share of the change that is lost in the flicker
        run = np.array(
            [k for k in range(first - 1, last + 2) if first <= k <= last or (0 <= k < d.size and not key[k])]
        )
        change = float(d[run].sum())
        moment = float(np.sum(d[run] * times[run + 1])) / change
        begun = times[np.searchsorted(times, moment, "right") - 1]
        shut = (1 - open_share) * step / np.sqrt(12)
        error = float(np.hypot(flicker / abs(change) * step * np.sqrt(run.size), shut))
        bent = _bent(light[run[0] : run[-1] + 2]) * step
        phase = float(d[first] / change) - 0.5 if last > first else np.nan
        found.append(_Change(begun + (moment - begun) * open_share, change, error, last - first, phase, bent))
    if shutter is None:
        found = _doubted(found, step)
    at, size, sd = np.array([change[:3] for change in found]).reshape(-1, 3).T
    return at, size, sd


class _Change(NamedTuple):
    moment: float  # s
    size: float  # grey levels
    sd: float  # s
    between: int  # pictures between dark and bright; -1 for a flash, which was both on one picture
    phase: float  # of the first of them: its share of the light less a half; NaN where there is none
    bent: float  # s, by which the moment is earlier if levels go as a power of the light


def _bent(levels: Array) -> float:
    """By how many intervals a change's moment moves if these levels (n,), from before to after it, are light^GAMMA."""
    light = np.maximum(levels, 0.0) ** (1 / GAMMA)
    shares = [(x - x[0]) / (x[-1] - x[0]) for x in (levels, light)]
    return float(abs(np.sum(shares[0] - shares[1])))


def _doubted(found: Sequence[_Change], step: float) -> list[_Change]:
    """The changes with what an unknown shutter and gamma may do in their errors.

    k of n changes fell within an exposure: S has a Beta(k + 1, n - k + 1) distribution, any S as likely beforehand.
    A change seen with the share p of its picture lit is off by (1 - S)(1/2 - p); one seen between two pictures by up
    to half of 1 - S either way; a ramp over m pictures by about 1/m of that.
    """
    sudden = [change for change in found if change.between in (0, 1)]
    within = sum(change.between for change in sudden)
    a, b = within + 1, len(sudden) - within + 1
    shut = np.sqrt(b * (b + 1) / ((a + b) * (a + b + 1))) * step
    out = []
    for change in found:
        if change.between >= 0:
            lost = abs(change.phase) if change.between == 1 else 1 / np.sqrt(12) / max(change.between, 1)
            sd = float(np.sqrt(change.sd**2 + (shut * lost) ** 2 + (change.bent / 2) ** 2))
            change = change._replace(sd=sd)
        out.append(change)
    return out


def _runs(key: Array) -> list[tuple[int, int]]:
    """First and last index of every stretch of one value that is not 0."""
    edges = [0, *(np.flatnonzero(np.diff(key)) + 1).tolist(), key.size]
    return [(a, b - 1) for a, b in pairwise(edges) if key[a] != 0]


def timing_from_flash(
    t_a: ArrayLike,
    level_a: ArrayLike,
    t_b: ArrayLike,
    level_b: ArrayLike,
    *,
    shutter: float | None = 1.0,
    alone_s: float = np.inf,
) -> Timing:
    """The clock of camera b that makes its changes of light fall on camera a's; its offset is that at b's first time.

    Times, levels and shutter as for `light_changes`. Changes are paired in the one way that lets most of them agree
    to within a picture, at the least offset. The rate needs three changes or more; NaN where none is in common.
    alone_s   s: a single pair further apart may be two things that each camera saw for itself, and gives no estimate
    """
    slack = 1.05 * max(interval(t_a), interval(t_b))
    changes = light_changes(t_a, level_a, shutter=shutter), light_changes(t_b, level_b, shutter=shutter)
    return timing_from_changes(*changes, slack=slack, start=float(np.asarray(t_b, float)[0]), alone_s=alone_s)


def timing_from_changes(
    of_a: tuple[Array, Array, Array],
    of_b: tuple[Array, Array, Array],
    *,
    slack: float,
    start: float,
    alone_s: float = np.inf,
) -> Timing:
    """The clock of b, whose first time is `start`, that makes its changes fall on those of a.

    of_a, of_b   moments, sizes (their signs count) and standard errors of changes, as of `light_changes`
    slack        s by which changes of one moment may seem apart
    """
    (a, size_a, sd_a), (b, size_b, sd_b) = of_a, of_b
    nothing = NOT_ESTIMATED._replace(of=max(a.size, b.size))
    if not a.size or not b.size:
        return nothing
    # through shutters that are mostly shut, the same delay shows as no picture now and as one then
    difference = a[:, None] - b
    alike = np.sign(size_a)[:, None] == np.sign(size_b)
    if not alike.any():
        return nothing
    apart = np.sort(difference[alike])
    count = np.searchsorted(apart, apart + slack) - np.searchsorted(apart, apart - slack, "right")
    best = min(range(apart.size), key=lambda k: (-count[k], abs(apart[k])))
    i, j = np.nonzero(alike & (np.abs(difference - apart[best]) < slack))
    lag, sd = difference[i, j], np.maximum(np.hypot(sd_a[i], sd_b[j]), 1e-6)
    if lag.size == 1 and abs(lag[0]) > alone_s:
        return nothing
    # a line through the lags, the slope near 0 unless they show it
    A = np.stack([1 / sd, (b[j] - start) / sd], -1)
    covariance = np.linalg.inv(A.T @ A + np.diag([0, (RATE_PRIOR_PPM * 1e-6) ** -2]))
    offset, rate = (covariance @ (A.T @ (lag / sd))).tolist()
    # where the moments scatter by more than the flicker explains, so does the answer
    off = lag / sd - A @ (offset, rate)
    covariance = covariance * max(1.0, float(off @ off) / max(lag.size - 1, 1))
    unit = np.array([1.0, 1e6])
    return Timing(Clock(offset, 1e6 * rate), covariance * unit * unit[:, None], lag.size, max(a.size, b.size))
