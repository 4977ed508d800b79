"""Whether the video's pictures came at another rate than its file states, by a contact sensor's record.

A file that states 25 pictures a second where 29.97 were taken (a conversion, slow motion played back slowly) stretches
all times alike: cameras agree with each other, and only a clock that is not theirs shows it.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.motion.lag import FEWEST, Lag, find_lag

RATES = (24, 25, 30, 50, 60, 120, 240)
"""Pictures a second that recorders have; those of 29.97 and others are within 0.1 % of one."""

MOST = 10
"""Times by which two rates differ at most."""

AGREES = 0.99
"""Correlation from which on the stated rate is not doubted."""

BETTER = 10.0
"""Times less that must be unexplained at another rate: noise and filters leave as much at each."""


def picture_rate(tr: Array, r: Array, t: Array, video: Array, lag: Lag) -> Finding | None:
    """A finding where the records agree at another rate of pictures, and not at the stated one; else None.

    tr, r      (n,) times (s) and values of the reference; t, video (m,) those of the video, NaN where missing
    lag        of the video behind the reference, at the stated rate
    """
    if abs(lag.correlation) >= AGREES or len(t) < 2 * FEWEST:
        return None
    left = 1.0 if not np.isfinite(lag.correlation) else 1 - lag.correlation**2
    tried = {q: find_lag(tr, r, t[0] + (t - t[0]) * float(q), video) for q in _ratios()}
    # as many samples must be compared: a few agree at many rates
    fits = {q: 1 - own.correlation**2 for q, own in tried.items() if 2 * own.n >= max(len(t) / 2, lag.n)}
    best = min(fits, key=lambda q: fits[q], default=None)
    if best is None or not (fits[best] * BETTER < left and tried[best].correlation > AGREES):
        return None
    rate = (len(t) - 1) / float(t[-1] - t[0])
    text = (
        f"reference and video agree (to {tried[best].correlation:.3f}, not {lag.correlation:.2f}) where pictures "
        f"came at {rate / float(best):.4g} a second instead of {rate:.4g}: the recordings seem to state a wrong rate; "
        "all times and velocities are wrong by that ratio"
    )
    cure = "Give runs.<run>.rate as the cameras recorded it; or see whether the reference's times are seconds."
    return Finding("bad", "picture-rate-wrong", text, cure)


def _ratios() -> list[Fraction]:
    """Stated over true rates, without 1."""
    ratios = {Fraction(a, b) for a in RATES for b in RATES if a != b}
    return sorted(q for q in ratios if Fraction(1, MOST) <= q <= MOST)
