"""The correction of one camera's time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array

RATE_PRIOR_PPM = 100.0
"""ASSUME: crystals of cameras and recorders lie within some 100 ppm of each other (one sd)."""


@dataclass(frozen=True)
class Clock:
    """A correction of one camera's time.

    offset_s   s, added to the camera's time
    rate_ppm   parts per million by which time after the first sample is stretched
    """

    offset_s: float = 0.0
    rate_ppm: float = 0.0

    def corrected(self, t: ArrayLike) -> Array:
        """Right times, s, of a camera's times (n,), s: t0 + (t - t0)(1 + rate) + offset, t0 the earliest of them."""
        t = np.asarray(t, float)
        first = np.nanmin(t) if t.size else 0.0
        return t + (t - first) * (self.rate_ppm * 1e-6) + self.offset_s
