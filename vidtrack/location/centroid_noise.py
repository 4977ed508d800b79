"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import locate_points

MOST = 4000
"""Samples of each track that are looked at."""


def noise_factor(cameras: Sequence[Camera], b: Array, sd: Array, fallback: float, *, lag: int = 1) -> float:
    """By how much the standard deviations of centroids are to be multiplied, as the reprojection errors show.

    b, sd      (n_cameras, n_targets, T, 2)  px, along tracks; NaN where lost. sd is only relative
    fallback   the answer where fewer than 30 redundant differences tell it
    lag        samples from one to the next that share no noise; samples brought to common moments do with the next two

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them changes slowly and steadily: their second differences show the noise alone. Merged or
    mistaken samples do not count.
    """
    b, sd = b[:, :, :MOST], np.nan_to_num(sd[:, :, :MOST], nan=1.0)
    if not b.size or b.shape[2] <= 2 * lag:
        return fallback
    located = locate_points(cameras, b, sd=sd)
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    first, middle, last = slice(None, -2 * lag), slice(lag, -lag), slice(2 * lag, None)
    change = located.error[:, :, first] - 2 * located.error[:, :, middle] + located.error[:, :, last]
    change /= np.sqrt(sd[:, :, first] ** 2 + 4 * sd[:, :, middle] ** 2 + sd[:, :, last] ** 2)
    same = (used[:, :, first] == used[:, :, middle]) & (used[:, :, middle] == used[:, :, last])
    both = same.all(0) & (used[:, :, middle].sum(0) >= 2)
    spare = np.where(both, 2.0 * used[:, :, middle].sum(0) - 3, 0)[both]
    chi2 = np.nansum(change**2, (0, -1))[both]
    if spare.sum() < 30:
        return fallback
    variance = float(np.median(chi2 / spare)) / 0.5
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * max(variance, 1e-12)
        variance = float(chi2[good].sum() / spare[good].sum())
    return max(float(np.sqrt(variance)), 1e-6)
