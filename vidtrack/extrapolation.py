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
    last = np.max(np.where(known, times[:, None], -np.inf), axis=0, initial=-np.inf)
    seen = np.isfinite(last)
    back = np.where(known, times[:, None] - np.where(seen, last, 0.0), 0.0)
    powers = np.stack([known.astype(float), back, back * back], axis=-1)  # of 1, t, t^2: (m, n, 3)
    normal = np.einsum("mni,mnj->nij", powers * known[..., None], powers) + _RIDGE
    side = np.einsum("mni,mnc->nic", powers, np.where(known[..., None], positions, 0.0))
    curve = np.linalg.solve(normal, side)  # (n, 3, 2)
    ahead = np.minimum(to[:, None] - np.where(seen, last, 0.0), LONGEST)
    forward = np.stack([np.ones_like(ahead), ahead, ahead * ahead], axis=-1)
    predicted: Array = np.einsum("kni,nic->knc", forward, curve)
    predicted[:, ~seen] = np.nan
    return predicted
