"""Whether a target is elsewhere from one sample to the next: a part of all recordings was cut out, or it was exchanged.

No other camera contradicts a cut that all recordings share, and their time stamps go on as if nothing were missing.
Nothing real jumps while it moves: what is struck changes its velocity, and the steps that follow are as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array


@dataclass(frozen=True)
class JumpRule:
    """When a step is a jump.

    beside    steps before it, and as many after it, that it is compared with, at their velocities
    times     the longest of them by which it departs from its two neighbours' mean, at least: an impact stays below one
    others    times what other steps depart: a swing near half the sampling rate departs in all of them alike
    sigmas    of the two positions that it exceeds besides
    moving    sigmas by which the target moves from sample to sample on both sides: what rests may be moved by hand
    missing   sampling intervals between two samples, from which on it is a gap and not a step
    """

    beside: int = 5
    times: float = 1.5
    others: float = 3.0
    sigmas: float = 8.0
    moving: float = 3.0
    missing: float = 1.5


JUMP = JumpRule()


class Jump(NamedTuple):
    """time_s of the first sample after it; how long it is, and the longest step beside it, world units."""

    time_s: float
    length: float
    usual: float


def jumps(time_s: Array, position: Array, sigma: Array) -> list[Jump]:
    """The jumps of one target that moves before and after them.

    time_s (n,) s, rising; position, sigma (n, 3) world units; NaN where it was not located, or has a flag
    """
    seen = np.flatnonzero(np.isfinite(position).all(1) & np.isfinite(sigma).all(1))
    if seen.size < 2 * JUMP.beside + 2:
        return []
    t, p, s = time_s[seen], position[seen], np.linalg.norm(sigma[seen], axis=1)
    dt = np.diff(t)
    step = np.diff(p, axis=0)
    speed = step / dt[:, None]
    length, doubt = np.linalg.norm(step, axis=1), np.hypot(s[:-1], s[1:])
    departs = np.zeros(len(step))  # by what each step's velocity differs from its neighbours', 1/s
    departs[1:-1] = np.linalg.norm(speed[1:-1] - (speed[:-2] + speed[2:]) / 2, axis=1)
    plain = dt < JUMP.missing * np.median(dt)
    out = []
    for i in range(JUMP.beside, len(step) - JUMP.beside):
        before, after = slice(i - JUMP.beside, i), slice(i + 1, i + 1 + JUMP.beside)
        moving = min(np.median(length[before]), np.median(length[after])) > JUMP.moving * doubt[i]
        if not (plain[i] and moving):
            continue
        usual = dt[i] * np.linalg.norm(np.concatenate([speed[before], speed[after]]), axis=1).max()
        others = dt[i] * np.concatenate([departs[before][:-1], departs[after][1:]]).max()
        if departs[i] * dt[i] > max(JUMP.times * usual, JUMP.others * others) + JUMP.sigmas * doubt[i]:
            out.append(Jump(float(t[i + 1]), float(length[i]), float(usual)))
    return out
