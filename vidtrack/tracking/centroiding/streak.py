"""What a ball shows that moves while the shutter is open: a disc drawn out along its way.

Three discs in a row explain it nearly as well.

    I(p) = A mean over t in (-1/2, 1/2) of Phi((r - |p - c - t L - (t^2 - 1/12) B|) / w)

with the middle c, the way L during the exposure, its bend B, the radius r, an edge w px wide and a light A, found by
least squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.disc_fit import Float32


@dataclass(frozen=True)
class StreakFit:
    """How a streak is fitted.

    looks     at the pixels, at most; enough: share by which a step must lessen the squares, or it is the last
    stations  of the exposure
    begin_px  w to begin with
    """

    looks: int = 120
    enough: float = 0.01
    stations: int = 14
    begin_px: float = 0.8


STREAK_FIT = StreakFit()
_T = (np.arange(STREAK_FIT.stations) + 0.5) / STREAK_FIT.stations - 0.5


def drawn_out(velocity: Array) -> Array:
    """By how much the second moments xx, yy, xy (3, ...), px^2, of a point grow that moves at velocities (2, ...), px a
    sample, while the shutter is open for a sample: v v^T / 12.
    """
    return np.stack([velocity[0] ** 2, velocity[1] ** 2, velocity[0] * velocity[1]]) / 12


def streak_left(over: Float32, used: Bools, blob: Bools, lines: int = 1) -> float:
    """What a streak leaves of a blob, rms in grey levels; inf where fewer pixels count than it has unknowns.

    over    (height, width) grey levels over the background; used: the pixels that count; blob: those of the blob
    lines   of the frame buffer to a row
    """
    from scipy.optimize import least_squares

    v, u = np.nonzero(blob)
    x, y = u.mean(), v.mean() * lines
    second = np.cov(np.stack([u, v * lines]))
    row, column = np.nonzero(used)
    u, v, seen = column - x, row * lines - y, over[used].astype(float)
    (across, along), axes = np.linalg.eigh(second)
    way = axes[:, 1] * np.sqrt(max(12 * (along - across), 1e-3))
    radius = 2 * np.sqrt(max(across, 0.1))
    p = np.array([0.0, 0.0, *way, 0.0, 0.0, np.log(radius), np.log(STREAK_FIT.begin_px)])
    if seen.size < p.size:
        return float("inf")
    fit = least_squares(_left, p, args=(u, v, seen), method="lm", ftol=STREAK_FIT.enough, max_nfev=STREAK_FIT.looks)
    return float(np.sqrt(2 * fit.cost / seen.size))


def _left(p: Array, u: Array, v: Array, seen: Array) -> Array:
    """What the streak of parameters p (8,) leaves of the grey levels seen (m,) at u, v px from where it began."""
    from scipy.special import ndtr

    x, y, a, b, c, d, log_r, log_w = p
    bend = _T**2 - 1 / 12
    off = np.hypot(u[:, None] - x - a * _T - c * bend, v[:, None] - y - b * _T - d * bend)
    share = ndtr((np.exp(log_r) - off) / np.exp(log_w)).mean(axis=1)
    return np.asarray(share * (share @ seen) / max(float(share @ share), 1e-9) - seen)
