"""Where moving targets will be next: a parabola through their last positions, leaning on what targets usually do.

A least-squares fit with priors: with one known position the target stays, with two it goes on, with three or more
it accelerates; noise and gaps are borne by the same formula.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOISE_PX = 0.3
"""# ASSUME: px, how well a position fits a parabola: its own noise and what the motion does besides."""
SPEED_PX = 30.0
"""# ASSUME: px a sample, usual speeds; only where a single position is known does it matter."""
ACCELERATION_PX = 10.0
"""# ASSUME: px a sample^2, usual accelerations."""
FADING = 0.6
"""Weight of a position for each sample of its age: what no parabola describes is the less harmful the fresher it is."""
LONGEST = 8.0
"""Samples: further ahead than this a parabola says nothing, and the target is expected to stand still."""

_RIDGE = np.diag([1e-9, (NOISE_PX / SPEED_PX) ** 2, (2 * NOISE_PX / ACCELERATION_PX) ** 2])


def predict(times: Array, positions: Array, to: Array) -> Array:
    """Predicted positions (k, n, 2), px.

    times      (m,) when the known positions were, in samples; positions (m, n, 2) px, NaN where the target was lost
    to         (k,) times wanted
    NaN for targets that have no known position.
    """
    known = np.isfinite(positions[..., 0])
    if known.all():
        return _parabola(times, positions, to)
    predicted = np.full((len(to), *positions.shape[1:]), np.nan)
    patterns, which = np.unique(known, axis=1, return_inverse=True)
    for i, there in enumerate(patterns.T):  # few: targets are lost and begun together or seldom
        some = which.ravel() == i
        if there.any():
            predicted[:, some] = _parabola(times[there], positions[there][:, some], to)
    return predicted


def _parabola(times: Array, positions: Array, to: Array) -> Array:
    """Predictions (k, n, 2) from positions (m, n, 2) that are all known."""
    back = times - times[-1]
    ahead = np.minimum(to - times[-1], LONGEST)
    powers = np.stack([np.ones_like(back), back, back * back])
    fresh = powers * FADING**-back
    forward = np.stack([np.ones_like(ahead), ahead, ahead * ahead], axis=1)
    weights = forward @ np.linalg.solve(fresh @ powers.T + _RIDGE, fresh)  # of each known position: (k, m)
    predicted: Array = (weights @ positions.reshape(len(times), -1)).reshape(len(to), *positions.shape[1:])
    return predicted
