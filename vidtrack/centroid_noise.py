"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.camera import Array, Camera
from vidtrack.triangulate import locate_points

LAG = 4
"""Samples between the reprojection errors whose differences show the noise."""

MOST = 4000
"""Samples of each track that are looked at."""


def noise_factor(cameras: Sequence[Camera], b: Array, sd: Array, fallback: float) -> float:
    """By how much the standard deviations of centroids are to be multiplied, as the reprojection errors show.

    b, sd      (n_cameras, n_targets, T, 2)  px, along tracks; NaN where lost. sd is only relative
    fallback   the answer where fewer than 30 redundant differences tell it

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them hardly changes: their differences over a few samples (samples brought to common
    moments share the noise of their neighbours) show the noise alone. Merged or mistaken samples do not count.
    """
    b, sd = b[:, :, :MOST], np.nan_to_num(sd[:, :, :MOST], nan=1.0)
    if not b.size or b.shape[2] <= LAG:
        return fallback
    located = locate_points(cameras, b, sd=sd)
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    late, early = slice(LAG, None), slice(None, -LAG)
    change = located.error[:, :, late] - located.error[:, :, early]
    change /= np.sqrt(sd[:, :, late] ** 2 + sd[:, :, early] ** 2)
    both = (used[:, :, late] == used[:, :, early]).all(0) & (used[:, :, late].sum(0) >= 2)
    spare = np.where(both, 2.0 * used[:, :, late].sum(0) - 3, 0)[both]
    chi2 = np.nansum(change**2, (0, -1))[both]
    if spare.sum() < 30:
        return fallback
    variance = float(np.median(chi2 / spare)) / 0.5
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * variance
        variance = float(chi2[good].sum() / spare[good].sum())
    return max(float(np.sqrt(variance)), 1e-6)
