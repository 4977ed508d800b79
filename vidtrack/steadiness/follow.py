"""What a camera that moved saw, as it would have seen it from where it was calibrated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.steadiness.turn import Law, slopes


class Undone(NamedTuple):
    """Positions (m, 2) px as the camera at rest would have them; variance (m, 2) px^2 that this adds."""

    b: Array
    variance: Array


def movement_at(time: Array, theta: Array, covariance: Array, at: Array) -> tuple[Array, Array]:
    """The movement (m, 4) and its covariance (m, 4, 4) at other moments (m,) s, by straight lines between those known.

    time (k,) rising, theta (k, 4), covariance (k, 4, 4); moments without a theta are passed over. Where the camera
    moved between two moments, it may have done so at once and at any time: the covariance has the spread of that. A
    moment with no known one around it has NaN.
    """
    known = np.isfinite(theta[:, 0])
    if not known.any():
        return np.full((len(at), 4), np.nan), np.full((len(at), 4, 4), np.nan)
    time, theta, covariance = time[known], theta[known], covariance[known]
    right = np.clip(np.searchsorted(time, at), 0, len(time) - 1)
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 1)
    span = np.where(right > left, time[right] - time[left], 1.0)
    share = np.clip((at - time[left]) / span, 0, 1)[:, None]
    step = theta[right] - theta[left]
    # a step at a moment that is unknown: it has happened with probability `share`
    spread = (share * (1 - share))[..., None] * step[:, :, None] * step[:, None, :]
    mixed = (1 - share)[..., None] * covariance[left] + share[..., None] * covariance[right]
    return theta[left] + share * step, mixed + spread


def undone(law: Law, b: Array, theta: Array, covariance: Array) -> Undone:
    """Positions b (m, 2) px of a camera that had moved by theta (m, 4), with its covariance (m, 4, 4), at rest.

    The law is inverted by iteration, which converges as the movement changes little over its own length.
    """
    rest = b.copy()
    for _ in range(8):
        rest += b - law(rest, theta)
    J = slopes(law, rest, theta)
    return Undone(rest, np.einsum("mik,mkl,mil->mi", J, covariance, J))
