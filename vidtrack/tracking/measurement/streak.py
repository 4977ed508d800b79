"""What a ball shows that moves while the shutter is open: a disc drawn out along its way.

Three discs in a row explain it nearly as well.

    I(p) = A mean over t in (-1/2, 1/2) of Phi((r - |p - c - t L - (t^2 - 1/12) B|) / w)

with the middle c, the way L during the exposure, its bend B, the radius r, an edge w px wide and a light A. The
parameters are found by Levenberg's and Marquardt's steps with differences for derivatives: few pixels, seldom wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.measurement.disc_fit import Float32


@dataclass(frozen=True)
class StreakFit:
    """How a streak is fitted.

    steps     at most; enough: share by which a step must lessen the squares, or it is the last
    stations  of the exposure
    begin_px  w to begin with
    change    of each parameter for a derivative: px, or of a logarithm
    """

    steps: int = 12
    enough: float = 0.01
    stations: int = 14
    begin_px: float = 0.8
    change: float = 0.02


STREAK_FIT = StreakFit()
_T = (np.arange(STREAK_FIT.stations) + 0.5) / STREAK_FIT.stations - 0.5


def streak_left(over: Float32, used: Bools, blob: Bools, lines: int = 1) -> float:
    """What a streak leaves of a blob, rms in grey levels.

    over    (height, width) grey levels over the background; used: the pixels that count; blob: those of the blob
    lines   of the frame buffer to a row
    """
    v, u = np.nonzero(blob)
    x, y = u.mean(), v.mean() * lines
    second = np.cov(np.stack([u, v * lines]))
    row, column = np.nonzero(used)
    u, v, seen = column - x, row * lines - y, over[used].astype(float)
    (across, along), axes = np.linalg.eigh(second)
    way = axes[:, 1] * np.sqrt(max(12 * (along - across), 1e-3))
    radius = 2 * np.sqrt(max(across, 0.1))
    p = np.array([0.0, 0.0, *way, 0.0, 0.0, np.log(radius), np.log(STREAK_FIT.begin_px)])
    left = _left(p, u, v, seen)
    damping = 1e-2
    for _ in range(STREAK_FIT.steps):
        by = STREAK_FIT.change * np.eye(p.size)
        slope = np.stack([(_left(p + step, u, v, seen) - left) / STREAK_FIT.change for step in by], axis=1)
        normal = slope.T @ slope
        trial = p - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope.T @ left)
        after = _left(trial, u, v, seen)
        before, now = float(left @ left), float(after @ after)
        if now < before:
            p, left, damping = trial, after, damping / 5
            if now > (1 - STREAK_FIT.enough) * before:
                break
        else:
            damping *= 10
    return float(np.sqrt(np.mean(left**2)))


def _left(p: Array, u: Array, v: Array, seen: Array) -> Array:
    """What the streak of parameters p (8,) leaves of the grey levels seen (m,) at u, v px from where it began."""
    x, y, a, b, c, d, log_r, log_w = p
    bend = _T**2 - 1 / 12
    off = np.hypot(u[:, None] - x - a * _T - c * bend, v[:, None] - y - b * _T - d * bend)
    share = _phi((np.exp(log_r) - off) / np.exp(log_w)).mean(axis=1)
    return np.asarray(share * (share @ seen) / max(float(share @ share), 1e-9) - seen)


def _phi(z: Array) -> Array:
    """The normal distribution function, to 3e-4."""
    return np.asarray(0.5 * (1 + np.tanh(np.sqrt(2 / np.pi) * (z + 0.044715 * z**3))))
